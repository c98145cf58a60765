"""The whole analysis of a session, as `rig analyze` prints it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rig.analysis.gravity import check_gravity
from rig.analysis.session import analyze
from rig.clock.calibration import Calibrator
from rig.protocol import reader
from rig.session.schema import RunState

if TYPE_CHECKING:
    from rig.analysis.gravity import GravityCheck
    from rig.analysis.session import Analysis, Progress
    from rig.clock.calibration import Calibration
    from rig.protocol.protocol import Protocol
    from rig.records import Drop
    from rig.session.reading import Reader


def protocol_of(session: Reader) -> Protocol:
    """Read the protocol as the session keeps it, with the beams that its timer had.

    Other timers may have had fewer than the protocol; a board's beams are those of the protocol.
    """
    protocol = reader.parse(session.protocol_text, session.protocol_source, kept=True)
    had = next((one["beams"] for _, one in session.identities() if "beams" in one), None)
    if had is None or protocol.gates is None:
        return protocol
    gates = tuple(gate for gate in protocol.gates.gates if gate.channel in had)
    return replace(protocol, gates=replace(protocol.gates, gates=gates))


def calibration(session: Reader) -> Calibration:
    """Calibrate a session's clock from everything it recorded."""
    return Calibrator().look(session, protocol_of(session).reference_u)


def results(session: Reader, progress: Progress | None = None) -> dict[str, Any]:
    """Analyse a session: what `rig analyze --json` prints.

    Parameters
    ----------
    session
        Open, for reading at least.
    progress
        Called with the number of drops done and the number of all.
    """
    return with_analysis(session, progress)[0]


def with_analysis(
    session: Reader, progress: Progress | None = None
) -> tuple[dict[str, Any], Analysis]:
    """Like `results`, with the analysis that they are of."""
    protocol = protocol_of(session)
    found, clock, drops = _analysed(session, protocol, progress)
    by_key = {(drop.run, drop.attempt): drop for drop in drops}
    said = found.json()
    for run in (*said["runs"], *said.get("superseded", [])):
        run["calibration"] = clock.used(by_key[run["run"], run["attempt"]])
    cases = [(run, by_key[run.run.number, run.attempt]) for run in found.runs]
    check = check_gravity(protocol, [(run, drop, clock.scale(drop)) for run, drop in cases])
    head = {"simulated": session.simulated, "clock": clock.details}
    said = head | {"calibration": clock.said | _checked(clock.said["notes"], check)} | said
    return said, found


def _checked(notes: list[str], check: GravityCheck | None) -> dict[str, Any]:
    """Add to a calibration what the free chain says of it."""
    if check is None:
        return {}
    if not check.agrees:
        notes = [
            *notes,
            f"the free chain falls with {check.measured.value:.4f} ± {check.measured.expanded:.4f} "
            f"m/s², the protocol says {check.stated.value:.4f} (Eₙ {check.normalized_error:.1f}): "
            "the clock, the beams' heights, the air or the protocol's gravity is not as stated",
        ]
    return {"gravity": check.json(), "notes": notes}


def detailed(session: Reader, progress: Progress | None = None) -> tuple[Analysis, Calibration]:
    """Analyse a session and keep everything, each edge's rod too."""
    return _analysed(session, protocol_of(session), progress)[:2]


def _analysed(
    session: Reader, protocol: Protocol, progress: Progress | None
) -> tuple[Analysis, Calibration, list[Drop]]:
    clock = Calibrator().look(session, protocol.reference_u)
    drops = list(session.drops())
    found = analyze(protocol, drops, clock.scale, rejected(session), progress)
    return found, clock, drops


def rejected(session: Reader) -> dict[tuple[int, int], tuple[str, ...]]:
    """Drops whose last state is that the operator rejected them, with the causes."""
    last = {(entry.run, entry.attempt): entry for entry in session.states()}
    return {key: entry.reasons for key, entry in last.items() if entry.state is RunState.REJECTED}


def tick_rates(session: Reader) -> dict[int, float]:
    """Calibrated tick rate of each run's latest drop, Hz."""
    clock = calibration(session)
    return {drop.run: clock.scale(drop).hz for drop in session.latest_drops()}
