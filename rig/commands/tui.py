"""``rig tui``."""

import asyncio
import gc
import os
import signal
import sys
from datetime import UTC, datetime
from pathlib import Path

from rig.commands.output import Arguments
from rig.ctrl_c import signals_go_to
from rig.daemon.socket_path import require_sockets
from rig.link.port import check_url
from rig.reasons import rig_error
from rig.tui.app import RigApp
from rig.tui.context import Options, ascii_only
from rig.tui.keys import read_keys


def main(arguments: Arguments) -> None:
    """Show the session, and carry it out."""
    options = _options(arguments)
    keys = read_keys(arguments.keys)
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise rig_error("no_terminal")
    # What is loaded stays: not looking through it for garbage saves a frame its latest 60 ms.
    asyncio.run(_show(RigApp(options, keys, loaded=gc.freeze)))


async def _show(app: RigApp) -> None:
    """Show it until it ends; a signal ends it as its user does, with the terminal restored.

    Raises
    ------
    KeyboardInterrupt
        It was a signal.
    Exception
        Any that nobody foresaw: Textual would only print it.
    """
    app.error_console.quiet = True
    soon = asyncio.get_running_loop().call_soon_threadsafe
    with signals_go_to(lambda *_: soon(app.exit, None, 1), signal.SIGINT, signal.SIGTERM):
        await app.run_async()
    if app._exception is not None:
        raise app._exception
    if app.return_code:
        raise KeyboardInterrupt


def _options(arguments: Arguments) -> Options:
    files = [*sorted(Path("protocols").glob("[!.]*.yaml")), *sorted(Path().glob("[!.]*.yaml"))]
    live = arguments.port or arguments.protocol or arguments.socket
    offline = bool(arguments.session) and not live
    if not offline:
        require_sockets()
    check_url(arguments.port or "")  # before a daemon is started for it
    fresh = f"{datetime.now(UTC):%Y%m%dT%H%M%SZ}.session"
    return Options(
        files=(Path(arguments.protocol),) if arguments.protocol else tuple(files),
        port=arguments.port or "",
        session=Path(arguments.session or fresh),
        seed=arguments.seed,
        socket=arguments.socket and arguments.socket.absolute(),
        offline=offline,
        bell=arguments.bell,
        ascii=arguments.ascii or ascii_only(os.environ),
    )
