"""Where clients come in: a socket, or a port and a token, and nobody else's in its place."""

from __future__ import annotations

import asyncio
import json
import os
import socket
from contextlib import suppress
from typing import TYPE_CHECKING

from rig.daemon import rpc
from rig.daemon.socket_path import prepare_folder, token_file
from rig.errors import InputError
from rig.files import write_atomic

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable
    from pathlib import Path

    Serve = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]

_PROBE_S = 1.0


async def listen(path: Path, serve: Serve, token: str) -> asyncio.Server:
    """Let clients come.

    Parameters
    ----------
    path
        The Unix socket; the file that stands for TCP is beside it.
    serve
        Called for each client.
    token
        What a client over TCP must know; empty for the socket.

    Raises
    ------
    InputError
        Another daemon is there, or the folder cannot be trusted.
    """
    prepare_folder(path.parent)
    if _answers_at_socket(path) or _answers_at_port(token_file(path)):
        raise InputError(
            f"another daemon answers at {path}",
            "use that one, stop it, or name another place with --socket",
        )
    for left_by_a_killed_one in (path, token_file(path)):
        left_by_a_killed_one.unlink(missing_ok=True)
    if not token:
        server = await asyncio.start_unix_server(serve, str(path), limit=rpc.REQUEST_LIMIT)
        path.chmod(0o600)
        return server
    server = await asyncio.start_server(serve, "127.0.0.1", 0, limit=rpc.REQUEST_LIMIT)
    file, port = token_file(path), server.sockets[0].getsockname()[1]
    file.touch(mode=0o600)
    write_atomic(file, json.dumps({"port": port, "token": token}))
    file.chmod(0o600)
    return server


def leave(path: Path, token: str) -> None:
    """Take away what showed the way."""
    with suppress(OSError):
        (token_file(path) if token else path).unlink()


def _answers_at_socket(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.settimeout(_PROBE_S)
        try:
            probe.connect(str(path))
        except (FileNotFoundError, ConnectionRefusedError):
            return False
        except OSError as error:
            raise InputError(
                f"cannot listen at {path}: {error}", "name another place with --socket"
            ) from error
    return True


def _answers_at_port(file: Path) -> bool:
    """Whether a daemon answers: any program may have the port of one that was killed."""
    try:
        told = json.loads(file.read_text("ascii"))
        hello = {"api": rpc.API, "client": "a daemon that starts", "token": told["token"]}
        with socket.create_connection(("127.0.0.1", told["port"]), _PROBE_S) as probe:
            probe.sendall(rpc.request("hello", hello, 1))
            return b'"jsonrpc"' in probe.recv(1 << 12)
    except (OSError, ValueError, KeyError, TypeError):
        return False


def notify_systemd() -> None:
    """Tell systemd that clients can come, where it asked to be told (sd_notify(3))."""
    address = os.environ.get("NOTIFY_SOCKET", "")
    if not address:
        return
    with (
        suppress(OSError),
        socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as out,
    ):
        out.connect("\0" + address[1:] if address.startswith("@") else address)
        out.send(b"READY=1")
