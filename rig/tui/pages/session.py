"""The session so far: the plan with its states, results against incline, the control chart."""

from __future__ import annotations

from itertools import groupby, zip_longest
from pathlib import Path
from typing import TYPE_CHECKING

from textual.content import Content

from rig.analysis.joint_fit import FEWEST
from rig.campaign.plan import done
from rig.measurands import averaged
from rig.protocol.protocol import Condition
from rig.report.numbers import fixed, plus_minus
from rig.report.parts import main_error
from rig.tui.desk import Face
from rig.tui.looks import LOOKS
from rig.tui.plots import session_pictures
from rig.tui.widgets.text import duration, plain

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rig.analysis.summary import Incline
    from rig.campaign.plan import RunLine
    from rig.tui.desk import Desk
    from rig.tui.model import Model


def face(model: Model, desk: Desk, width: int) -> Face:
    """Show the plan, results against incline, and control charts."""
    del width
    head = Content("\n").join([_progress(model), _plan(model)])
    view = model.view
    if view is None:
        return Face(head)
    shown = desk.latest("charts", (view.path, view.reading), lambda: [*session_pictures(view)])
    turned = desk.chart % max(1, len(shown))
    pictures = [*shown[turned:], *shown[:turned]]
    foot = pictures[0][1] if pictures else ""
    return Face(head, pictures=[picture for picture, _ in pictures], foot=Content(foot), beside=2)


def _progress(model: Model) -> Content:
    if model.loading:
        return Content(model.loading)
    runs = model.state.runs
    voids = model.voids.counts(runs)
    over = sum(done(line, voids.get(line.run, 0)) for line in runs)
    if not runs:
        return Content("No session is open.")
    width = 24
    filled = round(width * over / len(runs))
    pace = model.view.pace_s if model.view else None
    remaining = (
        f" · about {duration(pace * (len(runs) - over))} left" if pace and over < len(runs) else ""
    )
    session = plain(Path(str(model.state.section("session").get("path", ""))).name, 60)
    return Content.assemble(
        ("━" * filled, "$success"), ("─" * (width - filled), "$foreground 40%"),
        (f"  {over} of {len(runs)} runs", "bold"), f"{remaining}  ", (session, "$foreground 70%"),
        _fit_words(model),
    )  # fmt: skip


def _plan(model: Model) -> Content:
    """One line an incline and, of unlike chains, striker: a symbol a run, and the means so far."""
    unlike = model.protocol is not None and model.protocol.unlike_chains

    def condition(line: RunLine) -> Condition:
        return Condition(line.incline_deg, line.impact if unlike else None)

    summary = {}
    if model.view is not None:
        summary = {line.condition: line for line in model.view.analysis.summary}
    ordered = sorted(model.state.runs, key=condition)
    groups = [list(group) for _, group in groupby(ordered, key=condition)]
    means = [_means(summary.get(condition(group[0]))) for group in groups]
    longest = max(map(len, groups), default=0)
    widths = [max(map(len, column)) for column in zip_longest(*means, fillvalue="")]
    lines = []
    for group, parts in zip(groups, means, strict=True):
        padded = [part.ljust(width) for part, width in zip(parts, widths, strict=False)]
        marks = [*_marks(group, model), (" " * (longest - len(group) + 2), "")]
        head = f"{group[0].incline_deg:5g}° " if group[0].impact is not None else "drops  "
        head += f"{plain(group[0].impact, 12)} " if unlike and group[0].impact else ""
        lines.append(Content.assemble((head, "bold"), *marks, "  ".join(padded).rstrip()))
    return Content("\n").join(lines)


def _fit_words(model: Model) -> tuple[str, str]:
    """Say whether the means come from a joint fit."""
    view = model.view
    if view is None or not view.analysis.summary:
        return "", ""
    suffix = " · adding the newest …" if view.lagging else ""
    if view.fitted:
        return f"\njoint fit of {view.fitted} runs{suffix}", "$foreground 70%"
    joint = f"; joint fit from {FEWEST} good drops on" if not suffix else ""
    return f"\neach drop fitted alone{joint}{suffix}", "$foreground 70%"


def _marks(runs: Sequence[RunLine], model: Model) -> Iterator[tuple[str, str]]:
    """A symbol a run; the one that is on turns its colours round."""
    for line in runs:
        is_now = model.job is not None and line.run == model.job.run
        symbol, colour = LOOKS.get(line.state, ("?", "$foreground"))
        yield symbol, f"{colour} reverse" if is_now else colour


def _means(line: Incline | None) -> list[str]:
    """What is known of an incline so far."""
    if line is None:
        return []
    parts = [
        f"{row.symbol} {plus_minus(line.means[row.name], row.scale)} {row.unit}"
        for row in averaged()
        if row.name in line.means
    ]
    error = main_error(line)
    return parts if error is None else [*parts, f"Eₙ {fixed(error, 2)}"]
