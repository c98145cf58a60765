"""Recovery: writes all readable data of a damaged session into a new session."""

import json
from pathlib import Path

from rig.files import read_input
from rig.ports import is_simulated
from rig.reasons import errors_become, rig_error
from rig.recover.examine import ExaminedFile
from rig.session.schema import OLDER, RunState
from rig.session.store import Session


def save(examined: ExaminedFile, target: str | Path, protocol: str | None = None) -> list[str]:
    """Write a new session with all readable data.

    Parameters
    ----------
    examined
        The damaged session.
    target
        The new file.
    protocol
        Path of the protocol file, for a session that has lost its protocol.

    Returns
    -------
    list of str
        Data that could not be saved, and assumptions; empty if there are none.

    Raises
    ------
    SessionError
        It is not a session, its protocol is lost and not given, or the new file cannot be created.
    """
    if examined.foreign:
        raise rig_error("not_a_session", path=examined.snapshot.path, text=examined.foreign)
    rows = examined.rows
    source, text = _protocol(examined, protocol)
    simulated, notes = _find_world(examined)
    origin = rows.meta.get("origin", f"recovered from {examined.snapshot.path.name}")
    with Session.create(target, text, source, simulated=simulated, origin=origin) as session:
        for table in ("identity", "ping", "reference", "host_break", "bytes", "attachment"):
            session.add_rows(table, [row[1:] for row in rows.in_order(table)])
        notes += _drops(session, examined)
        # The hash chain begins with these rows: it proves nothing about their origin.
        session.add_rows("hash", [(OLDER, 0, b"")])
        session.commit()
    return [*examined.lost, *notes]


def _protocol(examined: ExaminedFile, file: str | None) -> tuple[str, str]:
    if file is not None:
        with errors_become("protocol_unreadable", OSError, UnicodeDecodeError, path=file):
            return Path(file).name, read_input(file).decode()
    if examined.rows.protocol is None or examined.rows.protocol_altered:
        raise rig_error("protocol_lost", path=examined.snapshot.path)
    return examined.rows.protocol


def _find_world(examined: ExaminedFile) -> tuple[bool, list[str]]:
    """Return whether the data are simulated (assumed if unknown), and remarks."""
    if world := examined.rows.meta.get("simulated", ""):
        return world == "true", []
    for identity in examined.rows.in_order("identity"):
        port = json.loads(identity[2]).get("port")
        if isinstance(port, str):
            return is_simulated(port), []
    return True, ["nothing says whether it is real, so the new session is stamped as simulated"]


def _drops(session: Session, examined: ExaminedFile) -> list[str]:
    """Add drops and the log of states; a drop without a state gets one."""
    jobs = set()
    for drop, _, host_ns, provenance in examined.drops:
        if drop.job not in jobs:
            session.add_drop(drop, host_ns=host_ns, provenance=provenance)
        jobs.add(drop.job)
    states = examined.rows.in_order("run_state")
    session.add_rows("run_state", [row[1:] for row in states])
    untold = sorted(jobs - {row[1:3] for row in states})
    for job in untold:
        session.add_state(*job, RunState.RECORDED, states[-1][-1] if states else 0)
    return [f"{job}: its verdict; rig run judges it anew" for job in untold]
