"""Report and CSV files of a session, written by the commands of those names beside the screen."""

from __future__ import annotations

import asyncio
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.tui.app import RigApp


async def write(app: RigApp, *command: str) -> None:
    """Run a command, and say where its files are or what went wrong.

    A process of its own: what it computes takes nothing from STOP.
    """
    app.tell(f"rig {command[0]}: working …")
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "rig", *command,
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
    )  # fmt: skip
    try:
        output, _ = await process.communicate()
    except asyncio.CancelledError:  # the screen is left
        process.kill()
        await process.wait()
        raise
    lines = [line for line in output.decode("utf-8", "replace").splitlines() if line.strip()]
    last_lines = lines[-1:] if process.returncode == 0 else lines[-2:]
    app.tell("; ".join(last_lines) or f"rig {command[0]} ended with {process.returncode}")
