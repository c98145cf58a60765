"""``rig daemon``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.output import say
from rig.daemon.listener import notify_systemd
from rig.daemon.log import logged_to_stderr
from rig.daemon.server import serve
from rig.daemon.socket_path import default_socket
from rig.link.port import check_url

if TYPE_CHECKING:
    from argparse import Namespace


def main(arguments: Namespace) -> int:
    """Own a port and serve clients, in the foreground, until a signal or the idle time ends it."""
    check_url(arguments.port)
    path = Path(arguments.socket).absolute() if arguments.socket else default_socket()

    def ready() -> None:
        say(f"rig daemon: {arguments.port} at {path}")
        notify_systemd()

    with logged_to_stderr():
        serve(arguments.port, path, tcp=arguments.tcp, idle_s=arguments.idle_timeout, ready=ready)
    say("rig daemon: ended")
    return 0
