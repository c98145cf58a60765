"""``rig doctor``."""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

from rig.cache.store import CacheFolder
from rig.commands.output import Arguments, print_findings, say
from rig.doctor import computer
from rig.doctor.board import BOARD_CHECKS
from rig.doctor.session import check_session
from rig.errors import DeviceError
from rig.link.port import open_port
from rig.selftest.board import BoardUnderTest, SelftestOptions
from rig.selftest.findings import Finding, Verdict, explain, make_check
from rig.selftest.run import run_checks
from rig.usb.listing import serial_ports


def main(arguments: Arguments) -> int:
    """Say what is well, and of what is not, what to do."""
    if arguments.clear_cache:
        CacheFolder().clear()
    checks = _findings(arguments.port, arguments.session)
    troubles = print_findings("findings", checks, as_json=arguments.json)
    things = f"{troubles} thing{'s' * (troubles > 1)}" if troubles else "nothing"
    more = "" if troubles or arguments.port else "; --port PORT asks the board too"
    say(f"{things} to do{more}")
    return DeviceError.exit_code if troubles else 0


def _findings(url: str | None, session: str | None) -> Iterator[Finding]:
    # Without a name no port is opened: that would restart the board behind it.
    paths = [url] if url and "://" not in url else []
    free = True
    for path in paths or [port.path for port in serial_ports() if port.candidate and not url]:
        for name, check in computer.PORT_CHECKS.items():
            finding = make_check(name.format(path=path), check, Path(path))
            free = free and (finding.reason is None or check is computer.check_modem_manager)
            yield finding
    if url and free:
        yield from _board(url)
    elif url:
        yield Finding("board", "its port cannot be used now", Verdict.NOT_POSSIBLE)
    yield make_check("packages", computer.check_packages, "chainrig")
    yield make_check("kept results", computer.describe_cache, CacheFolder())
    yield make_check("disk", computer.check_room, Path(session or "").parent)
    if session:
        yield from check_session(session)


def _board(url: str) -> Iterator[Finding]:
    try:
        with closing(open_port(url)) as port:
            yield from run_checks(BOARD_CHECKS, BoardUnderTest(port, SelftestOptions()))
    except DeviceError as error:
        yield explain("board", error)
