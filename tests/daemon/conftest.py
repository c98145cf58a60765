"""A rig of real processes for each test."""

import asyncio
from contextlib import asynccontextmanager
from types import SimpleNamespace

import pytest

from bench.process_fixture import ProcessFixture
from rig.daemon.client import Client
from rig.daemon.server import Server
from tests.waiting import PATIENCE_S


@pytest.fixture
def processes():
    """Have a board and a daemon for a protocol of one run."""
    with ProcessFixture(runs=1, seed=3) as made:
        made.start_daemon()
        yield made


@pytest.fixture
def client(processes):
    """Connect clients that are gone at the end of the test."""
    made: list[Client] = []

    def connect(name):
        made.append(processes.client(name))
        return made[-1]

    yield connect
    for one in made:
        one.close()


@pytest.fixture
def driver(processes, client):
    """Have a session open and control of it."""
    one = client("the driver")
    one.take_control()
    one.open_session(processes.protocol, processes.session)
    return one


@pytest.fixture
@asynccontextmanager
async def door(tmp_path):
    """Have a daemon in the test's own loop, whose simulated port is still closed."""
    path = tmp_path / "of a user" / "door" / "rig.sock"
    server, ready = Server("sim://", path), asyncio.Event()
    server.serving = asyncio.create_task(server.run(ready.set))
    try:
        async with asyncio.timeout(PATIENCE_S):
            await ready.wait()
            yield SimpleNamespace(server=server, path=path)
        failed = server.serving.done()
    finally:
        server.end()
        await asyncio.gather(server.serving, return_exceptions=True)
    assert failed or server.serving.exception() is None
    assert not any(path.parent.iterdir()), "nothing stays of it"
