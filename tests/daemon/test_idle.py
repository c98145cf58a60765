"""A daemon that nobody asked for by name ends when nobody needs it, and never with a drop."""

import asyncio

from rig.daemon import server
from rig.daemon.server import Server
from tests.tables import cases
from tests.waiting import PATIENCE_S


@cases
async def test_it_stays_while_anything_of_this_is_shown(tmp_path, monkeypatch, caplog, shown):
    caplog.set_level("INFO", "rig.daemon.server")
    monkeypatch.setattr(server, "_LOOK_S", 1e-3)
    alone, ready = (
        Server("sim://", tmp_path / "of a user" / "rig.sock", idle_s=0.0),
        asyncio.Event(),
    )
    alone.published.set(**shown)
    serving = asyncio.create_task(alone.run(ready.set))
    await ready.wait()
    await asyncio.sleep(0.1)
    assert not serving.done()
    alone.published.set(clients=0, drop={"state": "recorded"}, error=None, phase="idle")
    await asyncio.wait_for(serving, PATIENCE_S)
    assert caplog.messages[-1] == "no client for 0 s; nothing armed, falling or unsaved"
