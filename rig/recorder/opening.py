"""Making a session file, or finding that one can be gone on with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rig.errors import SessionError
from rig.ports import is_simulated, truth_file
from rig.protocol.plan import runs
from rig.reasons import Reason, make_error, published_reasons
from rig.session.store import Session

if TYPE_CHECKING:
    from pathlib import Path

    from rig.protocol.protocol import Protocol
    from rig.session.reading import Reader, StateEntry


_PLANNED: tuple[int, str, tuple[Reason, ...]] = (0, "planned", ())
"""Attempt, state and reasons of a run that the log does not name."""


def open_for(protocol: Protocol, source: Path, url: str, path: Path) -> Session:
    """Make a session, or open the one to be continued.

    Raises
    ------
    SessionError
        The file cannot be used, or belongs to another protocol or kind of port.
    """
    simulated = is_simulated(url)
    if not path.exists():
        if simulated:
            truth_file(path).unlink(missing_ok=True)  # of a session that is gone
        return Session.create(path, protocol.text, source.name, simulated=simulated, origin=url)
    session = Session.open(path)
    clash = None
    if session.protocol_text != protocol.text:
        values = {"path": str(path), "source": session.protocol_source}
        clash = make_error(SessionError, "other_protocol", **values)
    elif session.simulated != simulated:
        words = ("simulated", "a real port") if session.simulated else ("real", "a simulation")
        values = {"path": str(path), "recorded": words[0], "port": url, "kind": words[1]}
        clash = make_error(SessionError, "session_mixed", **values)
    if clash is not None:
        session.close()
        raise clash
    return session


def latest_board(session: Reader) -> dict[str, str]:
    """Say what is known of the board and port where the session was recorded at last."""
    boards = [identity for _, identity in session.identities() if "port" in identity]
    return {name: str(value) for name, value in boards[-1].items()} if boards else {}


def latest_states(session: Reader) -> dict[int, StateEntry]:
    """Return where each run stands that the log names."""
    return {entry.run: entry for entry in session.states()}


def describe_session(
    session: Reader, protocol: Protocol
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Describe a session and its plan as the sections ``session`` and ``runs`` of the state do."""
    latest = latest_states(session)
    plan = []
    for run in runs(protocol):
        entry = latest.get(run.number)
        attempt, state, reasons = (entry.attempt, entry.state, entry.reasons) if entry else _PLANNED
        plan.append(
            {
                "run": run.number,
                "incline_deg": run.incline_deg,
                "impact": run.impact,
                "free": run.free,
                "attempt": attempt,
                "state": str(state),
                **published_reasons(reasons),
            }
        )
    about = {
        "path": str(session.path),
        "source": session.protocol_source,
        "title": protocol.title,
        "created": session.meta["created"],
        "simulated": session.simulated,
        "planned": len(plan),
        "blind": protocol.blind and not session.unblinded,
    }
    return about, plan
