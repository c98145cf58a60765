"""The door: who comes in, what is said there, and what a client that does not read costs."""

import asyncio
import contextlib
import json
import os
import socket
import stat

import pytest

from bench.process_fixture import ProcessFixture
from rig.daemon import rpc
from rig.daemon.client import AsyncClient, Client, Line
from rig.daemon.listener import Door
from rig.daemon.socket_path import default_socket, prepare_folder
from rig.errors import DeviceError, InputError, RigError
from tests.tables import cases

_SECTIONS = {
    "daemon", "port", "link", "device", "statistics", "gates", "phase", "drop", "edges", "session",
    "runs", "control", "clients", "error", "release_test",
}  # fmt: skip


async def told(path, *lines):
    """Send lines and return what comes back until the daemon hangs up, or for each line."""
    reader, writer = await asyncio.open_unix_connection(path)
    writer.write(b"".join(lines))
    answers = []
    with contextlib.suppress(ConnectionError):
        for _ in lines:
            answers.append(json.loads(await reader.readline() or b"null"))  # noqa: PERF401
    answers += [None] * (len(lines) - len(answers))
    writer.close()
    return answers


HELLO = rpc.request("hello", {"api": rpc.API, "client": "t"}, 1)


async def test_only_the_user_may_come_near(door):
    async with door() as (_server, path):
        assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
        assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_a_folder_that_is_open_to_others_is_refused(tmp_path):
    tmp_path.chmod(0o755)
    with pytest.raises(InputError, match="open to other users"):
        prepare_folder(tmp_path)
    with pytest.raises(InputError, match="open to other users"):
        Client(Line(tmp_path / "rig.sock", "t"))


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"cannot use .*Not a directory") as caught:
        prepare_folder(tmp_path / "file" / "door")
    assert "--socket" in caught.value.hint


def test_somebody_elses_folder_is_refused(tmp_path, monkeypatch):
    tmp_path.chmod(0o700)
    monkeypatch.setattr(os, "getuid", lambda: tmp_path.stat().st_uid + 1)
    with pytest.raises(InputError, match="belongs to another user"):
        prepare_folder(tmp_path)


async def test_another_user_is_not_served(door, monkeypatch):
    async with door() as (_server, path):
        uid = os.getuid()
        monkeypatch.setattr("rig.daemon.server.peer_uid", lambda _: uid + 1)
        assert await told(path, HELLO) == [None]


async def test_a_client_of_another_version_is_told_so_and_sent_away(door):
    async with door() as (_server, path):
        skewed = rpc.request("hello", {"api": rpc.API + 1, "client": "t"}, 1)
        answer, end = await told(path, skewed, HELLO)
        error = rpc.error_of(answer)
        assert isinstance(error, rpc.VersionError)
        assert "version 2 of the daemon's interface" in str(error)
        assert end is None


@cases
async def test_nonsense_gets_its_code_and_the_next_request_its_answer(door, method, params, code):
    line = f"{params}\n".encode() if method is None else rpc.request(method, params, 2)

    async with door() as (_server, path):
        _, nonsense, answer = await told(path, HELLO, line, rpc.request("unsubscribe", {}, 3))
        assert nonsense["error"]["code"] == getattr(rpc, code)
        assert answer["result"] == {}


async def test_hello_comes_first(door):
    async with door() as (_server, path):
        answer, end = await told(path, rpc.request("subscribe", {}, 1), HELLO)
        assert answer["error"]["code"] == rpc.INVALID
        assert end is None


async def test_an_endless_line_ends_the_connection_and_not_the_daemon(door):
    async with door() as (_server, path):
        reader, writer = await asyncio.open_unix_connection(path)
        writer.write(HELLO + b"x" * (2 * rpc.REQUEST_LIMIT))
        await reader.readline()
        assert await reader.read() == b""
        writer.close()
        assert (await told(path, HELLO))[0]["result"]["api"] == rpc.API


async def test_a_snapshot_has_every_section_that_is_promised(door):
    async with door() as (_server, path):
        client = await AsyncClient.connect(path, "tui")
        await client.subscribe()
        assert set(client.replica.state) == _SECTIONS
        assert client.replica.state["port"] == {
            "url": "sim://", "simulated": True, "path": "sim://",
        }  # fmt: skip
        assert client.replica.state["clients"] == 1
        await client.close()


async def test_a_client_that_does_not_read_costs_little_and_gets_a_snapshot_when_it_does(door):
    async with door() as (server, path):
        slow = socket.socket(socket.AF_UNIX)
        slow.connect(str(path))
        slow.sendall(HELLO + rpc.request("subscribe", {}, 2))
        slow.setblocking(False)
        while not any(one.subscribed for one in server.service.connections):
            await asyncio.sleep(0)
        (stuck,) = server.service.connections
        quick = await AsyncClient.connect(path, "quick")
        await quick.subscribe()
        for number in range(400):
            server.published.set(error={"message": f"{number} " + "x" * 2000})
            server.service.publisher.spread()
            assert stuck.waiting() < 100_000
            while not str((quick.replica.state["error"] or {}).get("message")).startswith(
                f"{number} "
            ):
                await asyncio.sleep(0)  # the other one is not slowed down
        assert stuck.behind
        data = b""
        loop = asyncio.get_running_loop()
        while b'"method":"snapshot"' not in data or not data.endswith(b"\n"):
            data += await loop.sock_recv(slow, 1 << 20)
        methods = [json.loads(line).get("method") for line in data.splitlines()]
        last = json.loads(data.splitlines()[methods.index("snapshot")])["params"]
        assert last["state"]["error"]["message"].startswith("399 ")
        assert methods.count("change") < 400
        slow.close()
        await quick.close()


def test_a_second_daemon_is_refused_and_a_dead_ones_socket_is_not_in_the_way():
    with ProcessFixture(runs=1) as processes:
        processes.start_daemon()
        first = processes.daemon
        with pytest.raises(DeviceError, match="another daemon answers"):
            processes.start_daemon()
        processes.kill(processes.daemon)
        processes.kill(first)
        assert processes.socket.exists()
        processes.start_daemon()
        processes.client().close()


def test_a_place_that_cannot_be_a_socket_is_refused_and_left_as_it_is(tmp_path):
    tmp_path.chmod(0o700)
    (tmp_path / "my.yaml").write_text("chains")
    for name, why in (("my.yaml", "in use"), (110 * "x", "too long")):
        with pytest.raises(InputError, match=rf"cannot use .*{why}") as caught:
            Door(tmp_path / name)
        assert "--socket" in caught.value.hint
    assert (tmp_path / "my.yaml").read_text() == "chains"


def test_no_daemon_is_said_so(tmp_path):
    tmp_path.chmod(0o700)
    with pytest.raises(RigError, match=r"no daemon at .*/rig\.sock: No such file or directory"):
        Client(Line(tmp_path / "rig.sock", "t"))
    with pytest.raises(RigError, match="no daemon at"):
        asyncio.run(AsyncClient.connect(tmp_path / "rig.sock", "t"))


def test_the_usual_place(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/run/user/7")
    assert str(default_socket()) == "/run/user/7/chainrig/rig.sock"
    monkeypatch.delenv("XDG_RUNTIME_DIR")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert default_socket() == tmp_path / ".cache/chainrig/rig.sock"
