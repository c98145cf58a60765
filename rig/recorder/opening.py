"""Making a session file, or finding that one can be gone on with."""

from contextlib import ExitStack
from pathlib import Path
from typing import Any

from rig.ports import is_simulated, truth_file
from rig.protocol.protocol import Protocol
from rig.reasons import rig_error
from rig.recorder.run_lines import plan_lines
from rig.session.reading import Reader
from rig.session.store import Session


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
    with ExitStack() as undo:
        session = undo.enter_context(Session.open(path))
        if session.protocol_text != protocol.text:
            raise rig_error("other_protocol", path=str(path), source=session.protocol_source)
        if session.simulated != simulated:
            recorded, kind = ("real", "a simulation") if simulated else ("simulated", "a real port")
            values = {"path": str(path), "recorded": recorded, "port": url, "kind": kind}
            raise rig_error("session_mixed", **values)
        undo.pop_all()
    return session


def latest_board(session: Reader) -> dict[str, str]:
    """Say what is known of the board and port where the session was recorded at last."""
    boards = [identity for _, identity in session.identities() if "port" in identity]
    return {name: str(value) for name, value in boards[-1].items()} if boards else {}


def describe_session(session: Reader, protocol: Protocol) -> tuple[dict[str, Any], list[Any]]:
    """Describe a session and its plan as the sections ``session`` and ``runs`` of the state do."""
    plan = [line.json() for line in plan_lines(protocol.runs(), session.states())]
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
