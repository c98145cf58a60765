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


async def told(path, *lines):
    """Send lines and return what comes back until the daemon hangs up, or for each line."""
    reader, writer = await asyncio.open_unix_connection(path)
    writer.write(b"".join(lines))
    answers = []
    with contextlib.suppress(ConnectionResetError):
        for _ in lines:
            answers.append(json.loads(await reader.readline() or b"null"))  # noqa: PERF401
    answers += [None] * (len(lines) - len(answers))
    writer.close()
    return answers


HELLO = rpc.request("hello", {"api": rpc.API, "client": "t"}, 1)


def test_only_the_user_may_come_near(door):
    async def test(server, path):
        assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
        assert stat.S_IMODE(path.stat().st_mode) == 0o600

    door(test)


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


def test_another_user_is_not_served(door, monkeypatch):
    async def test(server, path):
        uid = os.getuid()
        monkeypatch.setattr("rig.daemon.server.peer_uid", lambda _: uid + 1)
        assert await told(path, HELLO) == [None]

    door(test)


def test_a_client_of_another_version_is_told_so_and_sent_away(door):
    async def test(server, path):
        skewed = rpc.request("hello", {"api": rpc.API + 1, "client": "t"}, 1)
        answer, end = await told(path, skewed, HELLO)
        error = rpc.error_of(answer)
        assert isinstance(error, rpc.VersionError)
        assert "version 2 of the daemon's interface" in str(error)
        assert end is None

    door(test)


NONSENSE = [
    (b"what?\n", rpc.PARSE),
    (b"[" * 5000 + b"\n", rpc.PARSE),
    (b'{"jsonrpc":"1.0","id":2,"method":"renew"}\n', rpc.INVALID),
    (b'{"jsonrpc":"2.0","id":true,"method":"renew"}\n', rpc.INVALID),
    (b'{"jsonrpc":"2.0","id":[2],"method":"renew"}\n', rpc.INVALID),
    (b'{"jsonrpc":"2.0","id":2,"method":2}\n', rpc.INVALID),
    (rpc.request("dance", {}, 2), rpc.NO_METHOD),
    (rpc.request("arm", {"run": 1}, 2), rpc.BAD_PARAMS),
    (rpc.request("fire", {"token": "x"}, 2), rpc.BAD_PARAMS),
    (rpc.request("wait", {"seconds": -1}, 2), rpc.BAD_PARAMS),
    (rpc.request("wait", {"seconds": True}, 2), rpc.BAD_PARAMS),
    (rpc.request("wait", {"seconds": float("nan")}, 2), rpc.PARSE),
    (rpc.request("open_session", {"protocol": "p.yaml", "session": "/s"}, 2), rpc.BAD_PARAMS),
    (rpc.request("open_session", {"protocol": "/p\0", "session": "/s"}, 2), rpc.BAD_PARAMS),
    (rpc.request("open_session", {"protocol": "/\ud800", "session": "/s"}, 2), rpc.BAD_PARAMS),
    (b"[]\n", rpc.INVALID),
    (b'{"jsonrpc":"2.0","method":"renew"}\n', rpc.INVALID),
    (b'[{"jsonrpc":"2.0","id":1,"method":"renew"}]\n', rpc.INVALID),
    (rpc.request("subscribe", {"to": "all"}, 2), rpc.BAD_PARAMS),
    (rpc.request("log_state", {"run": 1, "attempt": 1, "state": "fine", "reasons": []}, 2),
     rpc.BAD_PARAMS),
]  # fmt: skip


def test_nonsense_gets_its_code_and_the_next_request_its_answer(door):
    async def test(server, path):
        for line, code in NONSENSE:
            _, nonsense, answer = await told(path, HELLO, line, rpc.request("unsubscribe", {}, 3))
            assert nonsense["error"]["code"] == code, line
            assert answer["result"] == {}

    door(test)


def test_hello_comes_first(door):
    async def test(server, path):
        answer, end = await told(path, rpc.request("subscribe", {}, 1), HELLO)
        assert answer["error"]["code"] == rpc.INVALID
        assert end is None

    door(test)


def test_an_endless_line_ends_the_connection_and_not_the_daemon(door):
    async def test(server, path):
        reader, writer = await asyncio.open_unix_connection(path)
        writer.write(HELLO + b"x" * (2 * rpc.REQUEST_LIMIT))
        await reader.readline()
        assert await reader.read() == b""
        writer.close()
        assert (await told(path, HELLO))[0]["result"]["api"] == rpc.API

    door(test)


def test_a_client_that_does_not_read_costs_little_and_gets_a_snapshot_when_it_does(door):
    async def test(server, path):
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

    door(test)


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
