"""Any drop of a session again, with the same rig and plots, forwards and back."""

from __future__ import annotations

from statistics import mean, stdev
from typing import TYPE_CHECKING

from textual.content import Content

from rig.measurands import listed
from rig.reasons import notes_in
from rig.report.numbers import fixed
from rig.tui.choosing import condition
from rig.tui.desk import Face
from rig.tui.looks import LOOKS
from rig.tui.pages.drop import played
from rig.tui.plots import laid_over, run_picture
from rig.tui.widgets.text import plain

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.records import Job
    from rig.results.live import SessionView
    from rig.tui.desk import Desk
    from rig.tui.model import Model


def face(model: Model, desk: Desk, width: int) -> Face:
    """Show the drop that is played, or all that are looked at over each other."""
    view, job = desk.drop(model)
    if view is None or job is None:
        missing = model.loading or "No drop recorded yet. Press o to choose another session."
        if view is not None:
            missing = f"No drop matches {plain(desk.words, 40)}. Press f to change this."
        return Face(Content(missing))
    jobs = desk.jobs(model)
    shown = played(desk, view, job, model, _which(view, job, desk, jobs), width)
    if not desk.comparing:
        return shown
    laid = desk.latest(
        "laid", (view.path, view.reading, job, jobs),
        lambda: (laid_over(view, jobs, job), run_picture(view, jobs, job)),
    )  # fmt: skip
    pictures = [picture for picture in laid if picture is not None]
    return shown._replace(pictures=pictures, cursor=None, words=comparison(view, jobs))


def comparison(view: SessionView, jobs: Sequence[Job]) -> Content:
    """Write mean and standard deviation of what some drops measured."""
    lines = [Content.styled(f"{'':20}{'n':>4}{'mean':>9}{'SD':>9}", "bold")]
    for row in listed():
        measured = [view.results[job].quantities.get(row.name) for job in jobs]
        values = [quantity.value * row.scale for quantity in measured if quantity is not None]
        if values:
            scatter = fixed(stdev(values), 3) if len(values) > 1 else "–"
            label = f"{row.label} ({row.unit})"
            lines.append(
                Content(f"{label:20}{len(values):4}{fixed(mean(values), 3):>9}{scatter:>9}")
            )
    return Content("\n").join(lines)


def _which(view: SessionView, job: Job, desk: Desk, jobs: Sequence[Job]) -> Content:
    player, run, result = desk.tape, view.plan[job.run], view.results[job]
    symbol, colour = LOOKS.get(result.verdict, ("?", "$foreground"))
    only = f" ({plain(desk.words, 40)})" if desk.words else ""
    reasons = (line.reasons for line in reversed(view.states) if (line.run, line.attempt) == job)
    note = "".join(f"\nnote: {plain(text, 160)}" for text in notes_in(next(reasons, ())))
    arrow = "◀" if player.back else "▶"
    state = f"{arrow} playing" if player.playing else f"‖ paused {arrow}"
    speed = f"{player.speed:g} ×" if player.speed >= 1 else f"1/{1 / player.speed:g} ×"
    return Content.assemble(
        (f"drop {jobs.index(job) + 1} of {len(jobs)}{only}", "bold $primary"),
        f"  run {job.run}, attempt {job.attempt} · {condition(run)} · ",
        (f"{symbol} {result.verdict}", colour),
        f"\n{state} at {speed} real speed, t = {player.time_s * 1e3:.0f} ms · ",
        (plain(view.path.name, 60), "$foreground 70%"),
        ("  ▲ SIMULATED" if view.simulated else "", "bold $warning"),
        (note, "bold"),
    )
