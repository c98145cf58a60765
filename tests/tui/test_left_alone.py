"""The daemon that a screen started outlives the screen, and not for ever."""

import asyncio
import shutil

from rig.tui import client
from tests.tui.lab import PATIENCE_S, run, short_folder


def test_a_daemon_that_a_screen_started_ends_by_itself(monkeypatch):
    monkeypatch.setattr(client, "_IDLE_S", 1.0)
    folder = short_folder()

    async def work():
        there = asyncio.Event()

        async def connected():
            there.set()

        line = client.ReconnectingClient("sim://", folder / "rig.sock", connected)
        keeping = asyncio.get_running_loop().create_task(line.keep())
        await asyncio.wait_for(there.wait(), PATIENCE_S)
        keeping.cancel()
        assert line.daemon.poll() is None
        assert await asyncio.to_thread(line.daemon.wait, PATIENCE_S) == 0
        assert "no client for 1 s" in (folder / "rig.log").read_text()

    run(work())
    shutil.rmtree(folder)
