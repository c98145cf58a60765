"""``rig daemon``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.output import say
from rig.daemon.place import default_socket
from rig.daemon.server import notify_systemd, serve

if TYPE_CHECKING:
    from argparse import Namespace


def main(arguments: Namespace) -> int:
    """Own a port and serve clients, in the foreground, until SIGTERM or Ctrl-C."""
    path = Path(arguments.socket).absolute() if arguments.socket else default_socket()

    def ready() -> None:
        say(f"rig daemon: {arguments.port} at {path}")
        notify_systemd()

    serve(arguments.port, path, tcp=arguments.tcp, ready=ready)
    say("rig daemon: ended")
    return 0
