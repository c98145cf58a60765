"""The rig as its clients see it: through the daemon that owns the port, or without one."""

from __future__ import annotations

import os
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from rig.daemon.socket_path import default_socket, token_file
from rig.errors import DeviceError, RigError
from rig.reasons import make_error
from rig.recorder.controller import Controller

if TYPE_CHECKING:
    from collections.abc import Callable

    from rig.daemon.client import Client
    from rig.recorder.interrupts import Interrupts

    Rig: TypeAlias = Controller | Client
    """What can be asked of a rig; `Controller` says what each method does and raises."""


def connect(
    url: str, say: Callable[[str], None], interrupts: Interrupts, socket: Path | None = None
) -> Rig:
    """Find the owner of a port, or become it.

    Parameters
    ----------
    url
        The port.
    say
        Is told when a daemon does the work.
    interrupts
        As for `rig.recorder.recorder.Recorder`.
    socket
        Of the daemon to ask, which must then be there; else the usual one, if there is one.

    Returns
    -------
    Rig
        To be closed.

    Raises
    ------
    RigError
        The daemon that was named is not there or has another port; another client is in control.
    """
    path = default_socket() if socket is None else socket
    if socket is None and not path.exists() and not token_file(path).exists():
        return Controller(url, interrupts)
    from rig.daemon.client import Client  # noqa: PLC0415 - most runs have no daemon

    try:
        client = Client(path, f"rig run {os.getpid()}", interrupts)
    except RigError:
        if socket is not None:
            raise
        return Controller(url, interrupts)  # what a killed daemon left, or one of another version
    with ExitStack() as unless_in_control:
        unless_in_control.callback(client.close)
        # A board that was plugged in again may have another path than the daemon was told.
        if not any(_is_same(client.daemon.get(name, ""), url) for name in ("port", "path")):
            if socket is None:
                return Controller(url, interrupts)
            raise make_error(DeviceError, "daemon_port", port=client.daemon["port"], wanted=url)
        client.take_control()
        unless_in_control.pop_all()
    say(f"through the daemon, process {client.daemon['pid']}, which owns {url}")
    return client


def _is_same(port: str, url: str) -> bool:
    """Whether two names are of one port: a board has several in /dev."""
    if "://" in port + url:
        return port == url
    return Path(port).resolve() == Path(url).resolve()
