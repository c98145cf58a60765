"""Writing what can be read into a session of its own."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from rig.errors import SessionError
from rig.files import read_input
from rig.ports import is_simulated
from rig.records import ClockSample, HostBreak, Pulse
from rig.recover.examine import protocol_sound
from rig.session.reason_rows import read_reasons
from rig.session.schema import RunState
from rig.session.store import Session

if TYPE_CHECKING:
    import os

    from rig.recover.examine import Examined
    from rig.recover.rows import Rows


def save(found: Examined, target: str | os.PathLike[str], protocol: str | None = None) -> list[str]:
    """Write a new session with everything that could be read.

    Parameters
    ----------
    found
        The damaged session.
    target
        The new file.
    protocol
        The protocol file, for a session that has lost it.

    Returns
    -------
    list of str
        What could not be saved, and what had to be guessed; empty when nothing.

    Raises
    ------
    SessionError
        It is no session, its protocol is lost and not given, or the new file cannot be made.
    """
    if found.foreign:
        raise SessionError(f"{found.snapshot.path} is not a session file: {found.foreign}")
    rows = found.rows
    source, text = _protocol(found, protocol)
    simulated, notes = _simulated(rows)
    session = Session.create(
        target,
        text,
        source,
        simulated=simulated,
        origin=rows.meta.get("origin", f"recovered from {found.snapshot.path.name}"),
    )
    with session:
        for _, identity in sorted(rows.identity.items()):
            session.add_identity(json.loads(cast("str", identity[2])), cast("int", identity[1]))
        _clock(session, rows)
        for _, row in sorted(rows.bytes.items()):
            host_ns, direction, data = cast("Any", row)[1:]
            session.log_bytes(direction, host_ns, data)
        notes += _drops(session, found)
        session.commit()
    return [*found.lost, *notes]


def _protocol(found: Examined, given: str | None) -> tuple[str, str]:
    if given is not None:
        try:
            return Path(given).name, read_input(given).decode()
        except (OSError, UnicodeDecodeError) as error:
            raise SessionError(f"cannot read {given}: {error}") from error
    if found.rows.protocol is None or not protocol_sound(found.rows):
        raise SessionError(
            f"{found.snapshot.path} has lost its protocol file", "give it: --protocol FILE"
        )
    return found.rows.protocol


def _simulated(rows: Rows) -> tuple[bool, list[str]]:
    """Say whether the data are simulated; where nobody knows they are stamped so."""
    if "simulated" in rows.meta:
        return rows.meta["simulated"] == "true", []
    for _, identity in sorted(rows.identity.items()):
        port = json.loads(cast("str", identity[2])).get("port")
        if isinstance(port, str):
            return is_simulated(port), []
    return True, ["nothing says whether it is real, so the new session is stamped as simulated"]


def _clock(session: Session, rows: Rows) -> None:
    session.add_pings(ClockSample(*cast("Any", row)[1:]) for _, row in sorted(rows.ping.items()))
    for _, row in sorted(rows.reference.items()):
        session.add_pulse(Pulse(*cast("Any", row)[1:]))
    for _, row in sorted(rows.host_break.items()):
        session.add_host_break(HostBreak(*cast("Any", row)[1:]))


def _drops(session: Session, found: Examined) -> list[str]:
    """Add drops and the log of states; a drop that no state tells of gets one."""
    seen = set()
    for one in found.drops:
        if (one.drop.run, one.drop.attempt) not in seen:
            session.add_drop(one.drop, host_ns=one.host_ns, provenance=one.provenance)
        seen.add((one.drop.run, one.drop.attempt))
    told = set()
    last_ns = 0
    for _, row in sorted(found.rows.run_state.items()):
        run, attempt, state, reasons, last_ns = cast("Any", row)[1:]
        told.add((run, attempt))
        session.add_state(run, attempt, RunState(state), last_ns, read_reasons(reasons))
    notes = []
    for run, attempt in sorted(seen - told):
        session.add_state(run, attempt, RunState.RECORDED, last_ns)
        notes.append(f"run {run}, attempt {attempt}: its verdict; rig run judges it anew")
    return notes
