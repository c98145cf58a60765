"""``rig doctor``."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.output import say
from rig.doctor import checks
from rig.doctor.checks import Finding
from rig.doctor.gathering import (
    look_at_board,
    look_at_disk,
    look_at_packages,
    look_at_port,
    look_at_session,
)
from rig.errors import DeviceError, SessionError
from rig.link.port import open_port, port_clock
from rig.usb.listing import serial_ports

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator

_PORT = (checks.permission, checks.other_owners, checks.modem_manager)
_BOARD = (
    checks.firmware,
    checks.held_drop,
    checks.clock,
    checks.round_trip,
    checks.emergency_stop,
    checks.stuck_gates,
    checks.flickering_gates,
)


def main(arguments: Namespace) -> int:
    """Say what is well, and of what is not, what to do."""
    troubles = 0
    for finding in _findings(arguments.port, arguments.session):
        print(finding, flush=True)
        troubles += bool(finding.advice)
    if troubles:
        say(f"{troubles} thing{'s' * (troubles > 1)} to do")
    else:
        say("nothing to do" + ("" if arguments.port else "; --port PORT asks the board too"))
    return DeviceError.exit_code if troubles else 0


def _findings(url: str | None, session: str | None) -> Iterator[Finding]:
    # Without a name no port is opened: that would restart the board behind it.
    named = [url] if url and "://" not in url else []
    free = True
    for path in named or [port.path for port in serial_ports() if port.candidate and not url]:
        facts = look_at_port(path)
        free = facts.usable and not facts.owners
        yield from (check(facts) for check in _PORT)
    if url and free:
        yield from _board(url)
    elif url:
        yield Finding("board", "not asked: its port cannot be used now")
    yield checks.other_packages(look_at_packages())
    yield checks.disk_room(look_at_disk(Path(session).parent if session else Path()))
    if session and not Path(session).exists():
        yield Finding(f"session {session}", "not there", "check its name; rig run makes a new one")
    elif session:
        try:
            told = look_at_session(session)
            yield checks.session_file(told)
            if told.whole:
                yield from (checks.restarts(told), checks.supply(told))
        except SessionError as error:
            yield Finding(f"session {session}", error.message, error.hint)


def _board(url: str) -> Iterator[Finding]:
    try:
        with closing(open_port(url)) as port:
            facts = look_at_board(port, port_clock(port))
    except DeviceError as error:
        yield Finding("board", error.message, error.hint)
        return
    identity = facts.identity
    yield Finding("board", f"{identity.board}, id {identity.unique_id.hex()}")
    yield from (check(facts) for check in _BOARD)
