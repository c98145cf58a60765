"""The run in hand, from the first look at its gates to its result: steps, rig, plot and words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.content import Content

from rig.campaign.events import Stage
from rig.films import read_films
from rig.tui.desk import Face
from rig.tui.drop_words import expected_words, number_table, past_runs, sentence, why_words
from rig.tui.looks import verdict_words
from rig.tui.motion import as_table, motions
from rig.tui.next_step import hand, next_step
from rig.tui.plots import drop_pictures, fall_pictures
from rig.tui.replay import indicators_at, until
from rig.tui.scale import drawing
from rig.tui.widgets.gates import board
from rig.tui.widgets.text import plain

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.protocol.protocol import Run
    from rig.records import Job
    from rig.results.live import SessionView
    from rig.tui.desk import Desk
    from rig.tui.indicators import Indicators
    from rig.tui.model import Model
    from rig.tui.scale import Drawing

_FALLING = (Stage.LIVE, Stage.JUDGING)
_DONE = {Stage.SETTLING: 2, Stage.ARMING: 3, Stage.COUNTDOWN: 3, Stage.FIRING: 3, Stage.LIVE: 3,
         Stage.JUDGING: 4, Stage.RESULT: 5, Stage.HALTED: 5}  # fmt: skip
"""Steps that are behind, by stage."""


def face(model: Model, desk: Desk, width: int) -> Face:
    """Show the run in hand: before the drop, during it, or what it said."""
    if model.page == "result" or model.stage in {Stage.RESULT, Stage.HALTED}:
        return _result(model, desk, width)
    protocol, run = model.protocol, model.run
    if model.loading or protocol is None or run is None:
        return Face(Content(model.loading or next_step(model).text))
    hz = float(model.state.section("drop").get("tick_hz") or 1e6)
    live = model.stage in _FALLING
    edges = model.state.edges if live else ()
    # Only what is new is taken over: there may be thousands, and they come every tick.
    rows: list[Sequence[int]] = desk.latest("edges", (model.job, live), list)
    rows += edges[len(rows) :]
    key = (protocol, model.job, run, len(edges), live)
    falls = desk.latest("falls", key, lambda: motions(protocol, run, as_table(rows), hz))
    time_s = float(edges[-1][0]) / hz if edges else 0.0  # where the latest edge has them
    counting = model.stage is Stage.COUNTDOWN and model.driving
    expected = desk.latest("expected", (protocol, run), lambda: expected_words(protocol, run))
    facts = [f"drop   {protocol.drop.value * 1e3:.0f} mm {protocol.drop_from}"]
    facts += [f"model  {expected}"] if expected else []
    return Face(
        Content("\n").join([steps(model), _headline(model, run), _action(model)]),
        drawing(protocol, run, falls, model.indicators, time_s),
        desk.latest("pictures", key, lambda: fall_pictures(falls)),
        words=Content("\n").join(
            [*map(Content, facts), Content(""), *board(protocol, model.indicators, model.now_s)]
        ),
        digits=f"{max(0.0, model.flow.left_s):.1f}" if counting else "",
    )


def steps(model: Model) -> Content:
    """Write the steps of a run: behind, on, and to come."""
    indicators = model.indicators
    behind = _DONE.get(model.stage, 0)
    clear = indicators.known and not indicators.blocked
    still = clear and not indicators.restless(model.now_s)
    good = [behind > 0, behind > 1 or clear, behind > 2 or still, behind > 3, behind > 4]
    parts: list[Content] = []
    for at, (name, is_good) in enumerate(
        zip((hand(model), "Clear", "Still", "Drop", "Result"), good, strict=True)
    ):
        on = not is_good and at <= max(behind, 2)
        mark, color = ("✓", "$success") if is_good else ("◌", "$warning") if on else (" ", "")
        parts.append(Content.assemble((name, "bold" if on else ""), " ", (mark, color)))
    return Content(" · ").join(parts)


def _headline(model: Model, run: Run) -> Content:
    job = model.job
    attempt = f" · attempt {job.attempt}" if job and job.attempt > 1 else ""
    what = ""
    if run.impact is not None:
        strikes = f" · chain {plain(run.impact, 20)} strikes"
        what = f" · {run.incline_deg:g}°{strikes}"
    text = f"Run {run.number} of {len(model.state.runs) or 1}{attempt}{what}"
    return Content.styled(text, "bold $primary")


def _action(model: Model) -> Content:
    step = next_step(model)
    return Content.assemble(("→ ", f"bold {step.color}"), (step.text, f"bold {step.color}"))


def _result(model: Model, desk: Desk, width: int) -> Face:
    """Show what the latest drop said, in slow motion first."""
    parts = [verdict_words(model)]
    run = model.run
    if model.job is not None and run is not None:
        parts.insert(0, _headline(model, run))
    if model.stage in {Stage.RESULT, Stage.HALTED}:
        parts = [steps(model), *parts, _action(model)]
    head = Content("\n").join(parts)
    view, job = desk.drop(model)
    if view is None or job is None:
        return Face(head)
    player = desk.replay
    foot = Content("slow motion …  . pauses" if player.playing else sentence(view, job))
    return played(desk, view, job, model, head, width)._replace(
        foot=Content("\n").join([foot.stylize("bold $success"), past_runs(view, job, width)])
    )


def played(
    desk: Desk, view: SessionView, job: Job, model: Model, head: Content, width: int
) -> Face:
    """Show a recorded drop at the moment its player is at; all of it where nothing was played."""
    player = desk.player(model.page)
    drop, hz = view.drops[job], view.scales[job].hz
    begun = player.playing or player.time_s > 0.0 or model.page == "history"
    seen = until(drop.edges, hz, player.time_s) if begun else drop.edges
    indicators = indicators_at(view.channels, drop, seen)
    time_s = player.time_s if begun else seen[-1].tick / hz if seen else 0.0
    words = desk.latest(
        "words", (view.path, view.reading, job, width),
        lambda: Content("\n\n").join(
            [number_table(view, job, width), Content(why_words(view, job))]
        ),
    )  # fmt: skip
    gates = board(view.protocol, indicators, 0.0)
    return Face(
        head,
        _moment(desk, view, job, indicators, time_s),
        desk.latest("pictures", (view.path, job, hz, len(seen)),
                    lambda: drop_pictures(view, job, seen)),
        player.time_s * 1e3 if begun else None,
        Content("\n").join([words, Content(""), *gates]),
    )  # fmt: skip


def _moment(
    desk: Desk, view: SessionView, job: Job, indicators: Indicators, time_s: float
) -> Drawing:
    """Draw the rig at a moment of a recorded drop, from all of its edges."""
    run, hz = view.plan[job.run], view.scales[job].hz
    edges, matches = view.drops[job].edges, view.results[job].matches or None
    falls, film = desk.latest(
        "moment", (view.path, job, hz),
        lambda: (motions(view.protocol, run, edges, hz, matches), read_films(view.path).get(job)),
    )  # fmt: skip
    return drawing(view.protocol, run, falls, indicators, time_s, film)
