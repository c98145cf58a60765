"""Page of a drop, from the check of its gates to its result and replay: steps, rig, plot."""

from time import monotonic

from textual.content import Content

from rig.analysis.result import GOOD
from rig.campaign.machine import Stage
from rig.reasons import notes_in, remedies
from rig.records import Job
from rig.results.live import SessionView
from rig.results.whole import last_entries
from rig.tui.desk import Desk, Face
from rig.tui.drop_words import LOOKS, expected_words, headline, number_table, past_runs, sentence
from rig.tui.model import Model
from rig.tui.motion import ChainFall, motions
from rig.tui.next_step import hand, next_step
from rig.tui.plots import drop_pictures, fall_pictures
from rig.tui.replay import Player, indicators_at, until
from rig.tui.scale import Drawing, drawing
from rig.tui.widgets.gates import board
from rig.tui.widgets.text import plain

_DONE = dict.fromkeys((Stage.ARMING, Stage.COUNTDOWN, Stage.FIRING, Stage.LIVE), 3)
_DONE |= {Stage.SETTLING: 2, Stage.JUDGING: 4, Stage.RESULT: 5, Stage.HALTED: 5}
"""Number of completed steps, by stage."""
_REMEDIES = 2
"""Most instructions shown at once; others follow when these are done."""


def face(model: Model, desk: Desk) -> Face:
    """Return the page of the present run: before, during or after the drop."""
    if model.page in {"result", "history"} or model.stage in {Stage.RESULT, Stage.HALTED}:
        return _result(model, desk)
    protocol, run = model.protocol, model.run
    if model.loading or protocol is None or run is None:
        return Face(Content(model.loading or next_step(model).text))
    falls, rig = hanging(model, desk)
    counting = model.stage is Stage.COUNTDOWN and model.client.driving
    expected = desk.latest("expected", (protocol, run), lambda: expected_words(protocol, run))
    height = f"{protocol.of(run).drop.value * 1e3:.0f} mm {protocol.drop_from}"
    facts = f"drop   {height}\nmodel  {expected}\n"
    gates = board(protocol, model.indicators, desk.width)
    return Face(
        Content("\n").join([steps(model), *_headline(model), _action(model)]),
        rig,
        desk.latest("pictures", (protocol, run), lambda: fall_pictures(falls)),
        words=Content("\n").join([Content(facts), *gates]),
        digits=f"{max(0.0, model.flow.left_s):.1f}" if counting else "",
    )


def hanging(model: Model, desk: Desk) -> tuple[tuple[ChainFall, ...], Drawing | None]:
    """Return the predicted falls of the next run, and the rig with its gates as they are now."""
    protocol, run = model.protocol, model.run
    if protocol is None or run is None:
        return (), None
    falls = desk.latest("falls", (protocol, run), lambda: motions(protocol, run))
    blocked = model.indicators.blocked_channels
    key = protocol, run, blocked
    rig = desk.latest("rig", key, lambda: drawing(protocol, run, falls, blocked, 0.0))
    return falls, rig


def steps(model: Model) -> Content:
    """Return the steps of a run: done, present and to come."""
    indicators = model.indicators
    behind = _DONE.get(model.stage, 0)
    clear = indicators.known and not indicators.blocked_channels
    still = clear and not indicators.restless(monotonic())
    signs = {hand(model): False, "Clear": clear, "Still": still, "Drop": False, "Result": False}
    parts = []
    for at, (name, seen) in enumerate(signs.items()):
        coming = "◌" * (at <= max(behind, 2)), "$warning"
        mark = ("✓", "bold $success") if seen or at < behind else coming
        parts.append(Content.assemble(f"{name} ", mark))
    return Content(" · ").join(parts)


def _headline(model: Model) -> list[Content]:
    """Return the headline of the present run, if there is any."""
    run, job = model.run, model.job
    text = headline(run, len(model.state.runs) or 1, job.attempt) if run and job else ""
    return [Content.styled(text, "bold $primary")] * bool(text)


def _action(model: Model) -> Content:
    step = next_step(model)
    return Content.styled(f"→ {step.text}", f"bold {step.color}")


def verdict_words(model: Model) -> Content:
    """Return the verdict and its reasons in words."""
    verdict, reasons = model.verdict
    if model.job is None or not verdict:
        return Content(model.loading or "No verdict yet.")
    symbol, colour = LOOKS.get(verdict, ("?", "$foreground"))
    lines = [plain(reason, 200) for reason in reasons[:4]]
    lines += ["and more reasons, in the session file"] * (len(reasons) > 4)
    replaced = model.previous
    if verdict not in GOOD and replaced is not None:
        lines += [
            f"Only the latest attempt counts: attempt {replaced.attempt} was good, "
            f"but run {model.job.run} has no result now.",
            "→ press a to repeat it before you change anything at the rig",
        ]
    lines += ["BLIND: results are hidden until you unblind the session"] * model.blind
    if verdict == "void":
        lines += [f"→ {remedy}" for remedy in remedies(reasons)[:_REMEDIES]]
    badge = f" {symbol} {verdict.upper()} ", f"bold $background on {colour}"
    return Content.assemble(badge, *(f"\n  {line}" for line in lines))


def _result(model: Model, desk: Desk) -> Face:
    """Return the result of the latest drop, first in slow motion, or of a drop of the history."""
    view, job = desk.drop(model)
    own = model.page != "history"
    parts = [*_headline(model), verdict_words(model)] if own else []
    if own and model.stage in {Stage.RESULT, Stage.HALTED}:
        parts = [steps(model), *parts, _action(model)]
    if view is None or job is None:
        missing = model.loading or "No drop recorded yet. Press o to choose another session."
        return Face(Content("\n").join(parts or [Content(missing)]))
    player, hz = desk.players[model.page], view.scales[job].hz
    drop, edges = view.drops[job], view.drops[job].edges
    begun = player.playing or player.time_s > 0.0 or not own
    seen = until(edges, hz, player.time_s) if begun else edges
    indicators = indicators_at(view.channels, drop, seen)
    run, recorded = view.plan[job.run], (drop, hz, view.results[job])
    falls = desk.latest(
        "moment", (view.path, job, hz), lambda: motions(view.protocol, run, recorded)
    )
    key = view.path, view.reading, job
    pictures = desk.latest("figures", key, lambda: drop_pictures(view, job) or fall_pictures(falls))
    words = desk.latest("words", key, lambda: Content(number_table(view, job)))
    time_s = player.time_s if begun else seen[-1].tick / hz if seen else 0.0
    gates = board(view.protocol, indicators, desk.width)
    said = "slow motion …" if own and player.playing else sentence(view, job)
    foot = Content.assemble((said, "bold $success"), "\n" * bool(said), past_runs(view, job))
    return Face(
        Content("\n").join(parts or _which(view, job, player)),
        drawing(view.protocol, run, falls, indicators.blocked_channels, time_s),
        pictures,
        player.time_s - (falls[0].delay_s if falls else 0.0) if begun else None,
        Content("\n").join([words, Content(""), *gates]),
        foot,
    )


def _which(view: SessionView, job: Job, player: Player) -> list[Content]:
    """Return the name of the replayed drop, and the state of the replay."""
    verdict, run = view.results[job].verdict, view.plan[job.run]
    what = f"{run.set_up} {f'impact {run.impact}' if run.impact else run.free}".strip()
    state = "▶ playing" if player.playing else "‖ paused"
    logged = last_entries(view.states).get(job)
    said = notes_in(logged.reasons) if logged else []
    return [
        Content.assemble(
            (f"drop {view.jobs.index(job) + 1} of {len(view.jobs)}", "bold $primary"),
            f"  run {job.run}, attempt {job.attempt} · {plain(what, 40)} · ",
            (f"{LOOKS[verdict][0]} {verdict}", LOOKS[verdict][1]),
        ),
        Content(
            f"{state} at {player.speed:.3g} × real speed, t = {player.time_s * 1e3:.0f} ms · "
            f"{plain(view.path.name, 60)}{'  ▲ SIMULATED' * view.simulated}"
        ),
        *(Content(f"note: {plain(text, 160)}") for text in said),
    ]
