"""State of the rig: connection, firmware, clock, and a line for every gate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.content import Content

from rig.campaign.events import Stage
from rig.report.numbers import decimals_for, fixed
from rig.tui.desk import Face
from rig.tui.motion import motions
from rig.tui.scale import drawing
from rig.tui.widgets.gates import board, named
from rig.tui.widgets.text import checked, plain

if TYPE_CHECKING:
    from rig.tui.desk import Desk
    from rig.tui.model import Model


def face(model: Model, desk: Desk, width: int) -> Face:
    """Show what is connected, and what its gates see."""
    protocol, run = model.protocol, model.run
    picture = None
    if protocol is not None and run is not None:
        falls = desk.latest("hanging", (protocol, run), lambda: motions(protocol, run))
        picture = drawing(protocol, run, falls, model.indicators, 0.0)
    gates = board(protocol, model.indicators, model.now_s, width)
    words = [*gates, Content(""), _gate_check(model), _release(model)]
    return Face(_facts(model), picture, words=Content("\n").join(words), top=True)


def _facts(model: Model) -> Content:
    device, link = model.state.section("device"), model.state.section("link")
    statistics = model.state.section("statistics")
    lines: list[tuple[str, str]] = []
    state = {"up": "● up", "down": "✗ down: reconnecting", "opening": "◌ opening",
             "closed": "○ opens with the session"}  # fmt: skip
    lines.append(("connection", state.get(str(link.get("state")), "unknown")))
    if device:
        who = [f"{name.replace('_', ' ')} {plain(value, 40)}" for name, value in device.items()
               if name in {"board", "firmware", "version", "unique_id"}]  # fmt: skip
        lines.append(("board", " · ".join(who) or "connected"))
        if device.get("tick_hz"):
            lines.append(("tick", f"{1e9 / float(device['tick_hz']):g} ns nominal"))
    lines.append(("clock", _clock(model)))
    if statistics:
        trip = statistics.get("round_trip_s")
        answer = "–" if trip is None else f"{float(trip) * 1e3:.1f} ms"
        bad = int(statistics.get("rx_bad", 0)) + int(statistics.get("rx_unreadable", 0))
        lines.append(
            ("traffic", f"answers in {answer} · {statistics.get('rx_frames', 0)} frames, {bad} bad"
                        f" · {statistics.get('repeats', 0)} requests repeated")
        )  # fmt: skip
    return Content("\n").join(
        Content.assemble((f"{name:11}", "bold $primary"), text) for name, text in lines
    )


def _release(model: Model) -> Content:
    """Say what the test of the release saw."""
    if model.flow.stage is Stage.TESTING:
        return Content.styled("Testing the release; any key stops.", "bold $warning")
    seen = model.state.section("release_test")
    if not seen:
        return Content.styled("Release not tested yet.", "$foreground 70%")
    sense = seen["release_sense_s"]
    sensed = "no release sense" if sense is None else f"release sense after {sense * 1e3:.1f} ms"
    pulse = f"Release driven for {seen['pulse_s'] * 1e3:g} ms, {sensed}"
    if not seen["edges"]:
        return checked(True, f"{pulse}; no gate saw an edge.")
    where = ", ".join(named(model, channel) for channel in seen["gates"][:2])
    why = "Something fell, or the release disturbs the gates."
    return checked(False, f"{pulse}; {seen['edges']} edges at {where}. {why}")


def _clock(model: Model) -> str:
    details = model.view.clock.details if model.view else {}
    if "error_ppm" not in details or not details.get("samples"):
        return "not compared yet; this takes a few seconds"
    u = 2.0 * details["u_ppm"]
    digits = decimals_for(u)
    return (
        f"{fixed(abs(details['error_ppm']), digits)} ± {fixed(u, digits)} ppm "
        f"{'slow' if details['error_ppm'] < 0.0 else 'fast'}, corrected "
        f"({details['samples']} comparisons)"
    )


def _gate_check(model: Model) -> Content:
    gates = model.protocol.gates.gates if model.protocol and model.protocol.gates else ()
    indicators = model.indicators
    if not indicators.known:
        return Content("Waiting for the gates.")
    if indicators.alone is not None:
        return Content.assemble(
            ("☞ ", "bold $warning"), "blocked: ", (named(model, indicators.alone), "bold")
        )
    if indicators.blocked:
        return Content.assemble(
            ("● ", "bold $warning"),
            f"{len(indicators.blocked)} beams are blocked. Clear or align them."
        )  # fmt: skip
    left = [gate.channel for gate in gates if gate.channel not in indicators.checked]
    if not left:
        return checked(True, "every gate works")
    tested = f"{len(gates) - len(left)} of {len(gates)} gates tested"
    return Content(f"Wave a hand through each beam: {tested}.")
