"""The door: who comes in, what is said there, and what crowds and bad clients cost."""

import asyncio
import contextlib
import json
import os
import resource
import socket
import stat
from functools import partial
from unittest.mock import Mock

import pytest

from rig.daemon import rpc, service
from rig.daemon.client import AsyncClient, Line
from rig.daemon.listener import Door
from rig.daemon.socket_path import default_socket, peer_uid, prepare_folder
from rig.errors import BusyError, ControlError, InputError, RigError, VersionError
from rig.reasons import rig_error
from tests.daemon.test_api_page import rows
from tests.refusals import refused
from tests.tables import cases
from tests.waiting import PATIENCE_S


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


async def greeted(path, behind=b""):
    """Say hello, and what comes behind it, and hear the answer."""
    reader, writer = await asyncio.open_unix_connection(path)
    writer.write(HELLO + behind)
    await reader.readline()
    return reader, writer


async def test_only_the_user_may_come_near(door):
    assert stat.S_IMODE(door.path.parent.stat().st_mode) == 0o700
    assert stat.S_IMODE(door.path.stat().st_mode) == 0o600


def test_a_place_where_no_daemon_is_or_can_be_is_refused_and_left_as_it_is(tmp_path, monkeypatch):
    def seen(kind, words, *works):
        return [refused(kind, words, work, place).hint for work, place in works]

    file, place = tmp_path / "my.yaml", tmp_path / "rig.sock"
    file.write_text("chains")
    line, both = partial(Line, name="t"), partial(AsyncClient.connect, name="t")
    tmp_path.chmod(0o755)
    seen(InputError, "open to other users", (prepare_folder, tmp_path), (line, place))
    tmp_path.chmod(0o700)
    hints = seen(InputError, r"cannot use .*Not a directory", (prepare_folder, file / "door"))
    hints += seen(InputError, r"cannot use .*in use", (Door, file))
    hints += seen(InputError, r"cannot use .*too long", (Door, tmp_path / (110 * "x")))
    assert all("--socket" in hint for hint in hints)
    seen(RigError, r"no daemon at .*/rig\.sock: No such file or directory", (line, place))
    refused(RigError, "no daemon at", asyncio.run, both(place))
    monkeypatch.setattr(os, "getuid", lambda: tmp_path.stat().st_uid + 1)
    seen(InputError, "belongs to another user", (prepare_folder, tmp_path))
    assert file.read_text() == "chains"


def test_who_is_at_the_other_end_is_asked_where_a_kernel_can_tell(monkeypatch):
    near, far = socket.socketpair()
    with near, far, socket.socket(socket.AF_INET) as stranger:
        assert [peer_uid(near), peer_uid(stranger)] == [os.getuid(), None]
        monkeypatch.delattr(socket, "SO_PEERCRED")
        assert peer_uid(near) is None


async def test_another_user_is_not_served(door, monkeypatch):
    uid = os.getuid()
    monkeypatch.setattr("rig.daemon.server.peer_uid", lambda _: uid + 1)
    assert await told(door.path, HELLO) == [None]


async def test_a_client_of_another_version_is_told_so_and_sent_away(door):
    skewed = rpc.request("hello", {"api": rpc.API + 1, "client": "t"}, 1)
    answer, end = await told(door.path, skewed, HELLO)
    error = rpc.error_of(answer["error"])
    assert isinstance(error, VersionError)
    assert "version 2 of the daemon's interface" in str(error)
    assert end is None


@cases
async def test_nonsense_gets_its_code_and_the_next_request_its_answer(door, method, params, code):
    line = f"{params}\n".encode() if method is None else rpc.request(method, params, 2)

    _, nonsense, answer = await told(door.path, HELLO, line, rpc.request("unsubscribe", {}, 3))
    assert nonsense["error"]["code"] == code
    assert answer["result"] == {}


async def test_hello_comes_first(door):
    answer, end = await told(door.path, rpc.request("subscribe", {}, 1), HELLO)
    assert answer["error"]["code"] == rpc.INVALID
    assert end is None


async def test_an_endless_line_ends_the_connection_and_not_the_daemon(door):
    reader, writer = await greeted(door.path, b"x" * (2 * rpc.REQUEST_LIMIT))
    assert await reader.read() == b""
    writer.close()
    assert (await told(door.path, HELLO))[0]["result"]["api"] == rpc.API


async def test_a_snapshot_has_every_section_that_is_promised(door):
    client = await AsyncClient.connect(door.path, "tui")
    await client.call("subscribe")
    assert sorted(client.replica.state) == sorted(rows("State"))
    assert client.replica.state["port"] == {
        "url": "sim://", "simulated": True, "path": "sim://",
    }  # fmt: skip
    assert client.replica.state["clients"] == 1
    assert door.server.published.watched
    await client.call("unsubscribe")
    assert not door.server.published.watched
    await client.close()
    assert client.lost.is_set()


async def test_a_client_that_does_not_read_costs_little_and_gets_a_snapshot_when_it_does(door):
    slow = socket.socket(socket.AF_UNIX)
    slow.connect(str(door.path))
    slow.sendall(HELLO + rpc.request("subscribe", {}, 2))
    slow.setblocking(False)
    while not any(one.subscribed for one in door.server.service.connections):
        await asyncio.sleep(0)
    (stuck,) = door.server.service.connections
    quick = await AsyncClient.connect(door.path, "quick")
    await quick.call("subscribe")
    for number in range(400):
        door.server.published.set(error={"message": f"{number} " + "x" * 2000})
        door.server.service.publisher.spread()
        assert stuck.waiting() < 100_000
        while not str((quick.replica.state["error"] or {}).get("message")).startswith(f"{number} "):
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


async def test_a_daemon_at_which_nothing_changes_rests(door, monkeypatch):
    looks = Mock(return_value=None)
    monkeypatch.setattr(door.server.published, "take", looks)
    await asyncio.sleep(0.1)
    assert looks.call_count < 5


def test_a_second_daemon_is_refused_and_a_dead_ones_socket_is_not_in_the_way(tmp_path):
    place = tmp_path / "door" / "rig.sock"
    with contextlib.closing(Door(place)):
        refused(InputError, "another daemon answers", Door, place)
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(place))
    with contextlib.closing(Door(place)) as door:
        assert door.there()
    assert not any(place.parent.iterdir())


async def test_of_what_overtakes_eight_are_worked_on_at_once(door, monkeypatch):
    reader, writer = await greeted(door.path)
    (client,) = door.server.service.connections
    begun, held = [], asyncio.Event()

    async def do(_, request):
        begun.append(request.id)
        await held.wait()

    monkeypatch.setattr(client, "do", do)
    writer.write(b"".join(rpc.request("renew", {}, number) for number in range(20)))
    for _ in range(500):
        await asyncio.sleep(0)
    assert begun == [*range(9)], "and the next in its turn"
    held.set()
    assert len([await reader.readline() for _ in range(20)]) == 20
    writer.close()


def test_the_usual_place(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/run/user/7")
    assert str(default_socket()) == "/run/user/7/chainrig/rig.sock"
    monkeypatch.delenv("XDG_RUNTIME_DIR")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert default_socket() == tmp_path / ".cache/chainrig/rig.sock"


FEW = 200  # descriptors that the daemon may have: fewer than come


def test_a_silent_crowd_keeps_nobody_out(processes):
    resource.prlimit(processes.daemon.pid, resource.RLIMIT_NOFILE, (FEW, FEW))
    with contextlib.ExitStack() as crowd:
        for number in range(2 * FEW):
            line = crowd.enter_context(socket.socket(socket.AF_UNIX))
            line.setblocking(False)
            with contextlib.suppress(BlockingIOError):
                line.connect(str(processes.socket))
                line.send(b"{" * (number % 2))  # some begin a line
        client = processes.client("the one that means it")
        client.stop("enough")
        client.close()


def test_a_door_at_which_nobody_ever_looks_is_not_waited_at_for_ever(tmp_path, monkeypatch):
    monkeypatch.setattr("rig.daemon.client._REACH_S", 1)
    tmp_path.chmod(0o700)
    path = tmp_path / "rig.sock"
    with contextlib.ExitStack() as stack:
        deaf, waiting = (stack.enter_context(socket.socket(socket.AF_UNIX)) for _ in range(2))
        deaf.bind(str(path))
        deaf.listen(0)
        waiting.connect(str(path))  # the kernel keeps one waiting
        refused(BusyError, "it took no new client", Line, path, "one more")


async def test_beyond_the_last_client_stop_is_done_and_nothing_else(door, monkeypatch):
    monkeypatch.setattr(service, "CLIENTS", 2)

    clients = [await AsyncClient.connect(door.path, f"client {n}") for n in range(3)]
    with pytest.raises(BusyError, match="any further client may only stop"):
        await clients[2].call("subscribe")
    assert await clients[2].call("stop") == {}
    await clients[0].close()
    while door.server.published.get("clients") > 1:
        await asyncio.sleep(0)
    await (await AsyncClient.connect(door.path, "in its place")).close()
    for client in clients:
        await client.close()


async def test_who_says_nothing_is_told_so_and_sent_away(door, monkeypatch):
    monkeypatch.setattr("rig.daemon.server.HELLO_S", 0.05)

    reader, writer = await asyncio.open_unix_connection(door.path)
    told = json.loads(await reader.readline())
    assert (told["id"], told["error"]["data"]["kind"]) == (None, "BusyError")
    assert await reader.read() == b""
    writer.close()
    client = await AsyncClient.connect(door.path, "who says hello stays")
    await asyncio.sleep(0.1)
    assert await client.call("renew") == {"disk_s": 0.0}
    await client.close()


NAMES = ["\ud800x", "\x1b[2J", "\u202etxt.exe", "a\nb", "\0", "ü" * 500]


async def test_whatever_a_client_is_called_all_see_it(door, caplog):
    caplog.set_level("INFO", "rig.daemon.service")
    watcher = await AsyncClient.connect(door.path, "watcher")
    await watcher.call("subscribe")
    for name in NAMES:
        client = await AsyncClient.connect(door.path, name)
        await client.call("take_control")
        while watcher.replica.state["control"] is None:
            await asyncio.sleep(0)
        shown = watcher.replica.state["control"]["client"]
        assert shown.isprintable()
        assert len(shown) == min(len(name), 80)
        with pytest.raises(ControlError):
            await watcher.call("wait", seconds=0.0)
        assert await client.call("stop", reason=name) == {}
        await client.close()
        while watcher.replica.state["control"] is not None:
            await asyncio.sleep(0)
        assert caplog.messages[-2:] == [f"in control: {shown}", "in control: nobody"]
    assert len(caplog.messages) == 2 * len(NAMES)
    await watcher.close()


async def test_a_part_that_dies_ends_the_daemon_and_says_so(door, monkeypatch, caplog):
    broken = Mock(side_effect=ArithmeticError("of a kind that nobody foresaw"))
    monkeypatch.setattr(door.server.service.publisher, "spread", broken)
    door.server.published.set(error={"message": "anything"})
    with pytest.raises(ArithmeticError, match="nobody foresaw"):
        await door.server.serving
    assert "a part of the daemon failed" in caplog.text


async def test_a_worker_that_dies_ends_the_daemon(door, monkeypatch, caplog):
    monkeypatch.setattr(door.server._worker, "_attend", Mock(side_effect=SystemError))
    door.server._worker.wake()
    waiting = door.server._worker.submit(lambda _: None, None, writes=False)
    with pytest.raises(SystemError):
        await door.server.serving
    assert "internal error" in str(waiting.exception(PATIENCE_S))


async def test_who_is_held_up_is_shown_to_be_until_it_goes_on(door, monkeypatch, caplog):
    published, held_up = door.server.published, rig_error("held_up", late_s=2.0)

    async def shown(message):
        async with asyncio.timeout(PATIENCE_S):
            while (published.get("error") or {}).get("message") != message:
                await asyncio.sleep(0)

    stall = Mock(return_value=held_up)
    monkeypatch.setattr(door.server._worker, "stall", stall)
    await shown(held_up.message)
    stall.reset_mock(return_value=True)
    stall.return_value = None
    await shown(None)
    published.set(error={"message": "the worker's own"})
    while stall.call_count < 3:
        await asyncio.sleep(0)
    await shown("the worker's own")
    assert caplog.messages == [f"{held_up.message} ({held_up.hint})"]


async def test_a_stop_is_read_behind_any_number_of_requests(door, monkeypatch):
    reader, writer = await greeted(door.path)
    control = rpc.request("take_control", {}, 2)
    waits = [rpc.request("wait", {"seconds": 3600}, number) for number in range(3, 300)]
    (client,) = door.server.service.connections
    do = client.do

    async def held(one, request):
        if request.method == "wait":
            await asyncio.Event().wait()
        return await do(one, request)

    monkeypatch.setattr(client, "do", held)
    writer.write(control + b"".join(waits) + rpc.request("stop", {}, 1000))
    told = {}
    while not {299, 1000} <= told.keys():  # the stop may overtake
        answer = json.loads(await reader.readline())
        told[answer["id"]] = answer
    assert told[1000]["result"] == {}
    assert told[299]["error"]["data"]["kind"] == "BusyError"
    writer.close()


async def test_a_stop_waits_for_no_more_than_what_is_being_answered(door, monkeypatch):
    lines = [await greeted(door.path) for _ in range(21)]
    (_, stopping), *many = lines
    done, do = [], door.server.service.do

    def noted(client, request):
        if not done:
            stopping.write(rpc.request("stop", {}, 9))
        done.append(request.method)
        return do(client, request)

    for one in door.server.service.connections:
        monkeypatch.setattr(one, "do", noted)
    for _, writer in many:
        writer.write(b"".join(rpc.request("subscribe", {}, number) for number in range(20)))
    while "stop" not in done:
        await asyncio.sleep(0)
    assert done.count("subscribe") < len(many)
    for _, writer in lines:
        writer.close()


async def test_of_a_client_that_goes_nothing_stays(door):
    _, writer = await greeted(door.path)
    writer.close()
    while door.server._serving:
        await asyncio.sleep(0)
    await asyncio.sleep(0)  # what is cancelled ends in the next turn
    running = [task.get_coro().__qualname__ for task in asyncio.all_tasks()]
    assert not [name for name in running if name.startswith("Connection.")]
