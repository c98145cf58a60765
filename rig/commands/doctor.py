"""``rig doctor``."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from pathlib import Path

from rig.cache.store import CacheFile
from rig.command_help import runnable
from rig.commands.output import print_findings, say
from rig.doctor import computer
from rig.doctor.board import BOARD_CHECKS, look_at_board
from rig.doctor.session import check_session
from rig.errors import DeviceError, RigError, SessionError
from rig.link.port import open_port, port_clock
from rig.reasons import make_reason
from rig.selftest.findings import Finding, explain, make_check
from rig.usb.listing import note_early_boards, serial_ports


def main(arguments: Namespace) -> int:
    """Say what is well, and of what is not, what to do."""
    if arguments.clear_cache:
        CacheFile().clear()
    for note in note_early_boards(arguments.port):
        say(note)
    checks = _findings(arguments.port, arguments.session)
    findings = print_findings(
        "findings", checks, lambda finding: runnable(str(finding)), as_json=arguments.json
    )
    troubles = sum(bool(finding.advice) for finding in findings)
    things = f"{troubles} thing{'s' * (troubles > 1)}" if troubles else "nothing"
    more = "" if troubles or arguments.port else "; --port PORT asks the board too"
    say(f"{things} to do{more}")
    return DeviceError.exit_code if troubles else 0


def _findings(url: str | None, session: str | None) -> Iterator[Finding]:
    # Without a name no port is opened: that would restart the board behind it.
    paths = [url] if url and "://" not in url else []
    free = True
    for path in paths or [port.path for port in serial_ports() if port.candidate and not url]:
        permission, owners, modem = _check_all(computer.PORT_CHECKS, computer.PortPlace(path), path)
        free = not (permission.reason or owners.reason)
        yield from (permission, owners, modem)
    if url and free:
        yield from _board(url)
    elif url:
        yield Finding("board", "not asked: its port cannot be used now")
    folder = Path(session or "").parent
    yield make_check("packages called rig", computer.check_packages, "chainrig")
    yield make_check("kept results", computer.describe_cache, CacheFile())
    yield make_check("disk", computer.check_room, folder)
    if session and not Path(session).exists():
        yield explain(f"session {session}", make_reason("session_missing"))
    elif session:
        try:
            yield from check_session(session)
        except SessionError as error:
            yield _failure(f"session {session}", error)


def _check_all(
    checks: Mapping[str, Callable[..., str]], facts: object, path: str = ""
) -> Iterator[Finding]:
    for name, check in checks.items():
        yield make_check(name.format(path=path), check, facts)


def _failure(name: str, error: RigError) -> Finding:
    failed = make_reason("failed", text=error.message, hint=error.hint)
    return explain(name, next(iter(error.reasons), failed))


def _board(url: str) -> Iterator[Finding]:
    try:
        with closing(open_port(url)) as port:
            facts = look_at_board(port, port_clock(port))
    except DeviceError as error:
        yield _failure("board", error)
        return
    identity = facts.identity
    yield Finding("board", f"{identity.board}, id {identity.unique_id.hex()}")
    yield from _check_all(BOARD_CHECKS, facts)
