"""State of the rig: connection, firmware, clock, and a line for every gate."""

from collections import defaultdict

from textual.content import Content

from rig.campaign.machine import Stage
from rig.report.finding import clock_lines
from rig.tui.desk import Desk, Face
from rig.tui.model import Model
from rig.tui.pages.drop import hanging
from rig.tui.widgets.bars import LINKS
from rig.tui.widgets.gates import board, label
from rig.tui.widgets.text import check_line, plain


def face(model: Model, desk: Desk) -> Face:
    """Return the device page: connection, and state of the gates."""
    rig = hanging(model, desk)[1]
    gates = board(model.protocol, model.indicators, desk.width)
    words = [*gates, Content(""), _gate_check(model), _release(model)]
    return Face(_facts(model), rig, words=Content("\n").join(words), top=True)


def _facts(model: Model) -> Content:
    device, link = model.state.section("device"), str(model.state.section("link").get("state"))
    statistics = model.state.section("statistics")
    facts = {"connection": LINKS.get(link, "unknown")}
    if device:
        names = [name for name in ("board", "firmware", "version", "unique_id") if name in device]
        who = [f"{name.replace('_', ' ')} {plain(device[name], 40)}" for name in names]
        tick = f"tick {1e9 / float(device.get('tick_hz') or 1e9):g} ns nominal"
        facts["board"] = " · ".join([*who, tick])
    clock = model.view.clock.details if model.view else {}
    compared = bool(clock.get("samples")) and "error_ppm" in clock
    waiting = "not compared yet; this takes a few seconds"
    facts["clock"] = clock_lines({**clock, "notes": ()})[0] if compared else waiting
    if statistics:
        numbers = defaultdict(int, statistics)
        facts["traffic"] = (
            f"answers in {(numbers['round_trip_s'] or 0.0) * 1e3:.1f} ms · "
            f"{numbers['rx_frames']} frames, {numbers['rx_bad'] + numbers['rx_unreadable']} bad · "
            f"{numbers['repeats']} requests repeated"
        )
    return Content("\n").join(
        Content.assemble((f"{name:11}", "bold $primary"), text) for name, text in facts.items()
    )


def _release(model: Model) -> Content:
    """Return the result of the release test in words."""
    if model.flow.stage is Stage.TESTING:
        return Content.styled("Testing the release; any key stops.", "bold $warning")
    seen = model.state.section("release_test")
    if not seen:
        return Content.styled("Release not tested yet.", "$foreground 70%")
    sense = seen["release_sense_s"]
    sensed = "no release sense" if sense is None else f"release sense after {sense * 1e3:.1f} ms"
    pulse = f"Release driven for {seen['pulse_s'] * 1e3:g} ms, {sensed}"
    if not seen["edges"]:
        return check_line(True, f"{pulse}; no gate saw an edge.")
    where = ", ".join(label(model, channel) for channel in seen["gates"][:2])
    why = "Something fell, or the release disturbs the gates."
    return check_line(False, f"{pulse}; {seen['edges']} edges at {where}. {why}")


def _gate_check(model: Model) -> Content:
    gates = model.protocol.gates.gates if model.protocol else ()
    indicators = model.indicators
    if not indicators.known:
        return Content("Waiting for the gates.")
    if indicators.alone is not None:
        return Content.styled(f"☞ blocked: {label(model, indicators.alone)}", "bold $warning")
    if indicators.blocked_channels:
        many = f"● {len(indicators.blocked_channels)} beams are blocked. Clear or align them."
        return Content.styled(many, "bold $warning")
    left = [gate.channel for gate in gates if gate.channel not in indicators.checked]
    if not left:
        return check_line(True, "every gate works")
    tested = f"{len(gates) - len(left)} of {len(gates)} gates tested"
    return Content(f"Wave a hand through each beam: {tested}.")
