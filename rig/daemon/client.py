"""Clients of the daemon: the line that each has, and on it a blocking client and one for asyncio.

Scripts and the runner wait; faces, which show what is going on, have a loop of their own.
"""

import asyncio
import itertools
import json
import math
import socket
import struct
import threading
from collections.abc import Callable
from concurrent.futures import Future, wait
from contextlib import ExitStack, nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import Any, Self, TypeAlias

import msgspec

from rig.daemon import rpc
from rig.daemon.lease import LEASE_S
from rig.daemon.replica import Replica
from rig.daemon.socket_path import check_folder
from rig.errors import RigError
from rig.reasons import errors_become, rig_error
from rig.recorder.interrupts import Interrupts
from rig.records import Drop, Job
from rig.session.reading import Reader
from rig.session.schema import Reasons, RunState
from rig.session.store import Session

Hook: TypeAlias = Callable[..., object]

HELLO_S = 10.0
"""How long a client waits for the answer to `hello`."""
_REACH_S = 5.0  # until the daemon takes a new client
_HEED_S = 0.25
"""A signal just before the main thread waits does not wake it: it wakes by itself, this often."""
_ANSWER_S = 100.0  # everything but waiting is over by then, a recording too, or the daemon hangs
_BEAT_S = LEASE_S / 4


class Line:
    """One connection: requests from any thread, each answer a future.

    Parameters
    ----------
    path
        The daemon's Unix socket.
    name
        What others are told of this client.
    notify
        Called in the line's own thread with the name and parameters of each notification; the
        answer to ``subscribe`` comes as a ``snapshot`` before what changed since.
    end
        Called there when the connection has ended.

    Attributes
    ----------
    daemon
        What the daemon said to `hello`.

    Raises
    ------
    DeviceError
        No daemon there, or no answer from it.
    VersionError
        It speaks another version.
    """

    def __init__(
        self, path: Path, name: str, notify: Hook = lambda *_: None, end: Hook = lambda *_: None
    ) -> None:
        self._notify, self._end = notify, end
        self._guard = threading.Lock()  # one line after the other, and none after the end
        self._numbers = itertools.count(1)
        self._open: dict[int, Future[Any]] = {}
        self._over: RigError | None = None
        self._socket = _reach(path)
        self._thread = threading.Thread(target=self._read, name="rig client", daemon=True)
        self._thread.start()
        try:
            hello = self.ask("hello", api=rpc.API, client=name)
            silent = rig_error("daemon_silent", path=path, patience_s=HELLO_S)
            self.daemon: dict[str, Any] = _result(hello, HELLO_S, silent)
        except BaseException:
            self.close()
            raise

    def ask(self, method: str, **params: Any) -> Future[Any]:
        """Send a request, see API.md; what the daemon raises is the future's exception."""
        answer: Future[Any] = Future()
        with self._guard:
            if self._over is not None:
                answer.set_exception(self._over)
                return answer
            number = next(self._numbers)
            self._open[number] = answer
            try:
                self._socket.sendall(rpc.request(method, params, number))
            except OSError:  # the thread that reads knows more of it
                self._hang_up()
        return answer

    def close(self) -> None:
        """Hang up; what is not answered never will be."""
        self._hang_up()
        self._thread.join()
        self._socket.close()

    def _hang_up(self) -> None:
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def _read(self) -> None:
        over = rig_error("daemon_gone", text="it hung up")
        try:
            with errors_become("daemon_gone", OSError), self._socket.makefile("rb") as stream:
                while (line := stream.readline(rpc.MESSAGE_LIMIT)).endswith(b"\n"):
                    with errors_become("not_a_daemon", ValueError, msgspec.ValidationError):
                        message = msgspec.convert(json.loads(line), dict[str, Any])
                    self._take(message)
        except RigError as error:
            over = error
        finally:
            with self._guard:
                self._over, unanswered = over, [*self._open.values()]
            for answer in unanswered:
                if answer.set_running_or_notify_cancel():
                    answer.set_exception(over)
            self._hang_up()
            self._end()

    def _take(self, message: dict[str, Any]) -> None:
        if "method" in message:
            self._notify(message["method"], message["params"])
            return
        if "error" in message and message.get("id") is None:  # it hangs up after this
            raise rpc.error_of(message["error"])
        answer = self._open.pop(message["id"], None)
        result = message.get("result")
        if isinstance(result, dict) and "state" in result:
            self._notify("snapshot", result)
        if answer is None or not answer.set_running_or_notify_cancel():
            return
        if message.get("error") is not None:
            answer.set_exception(rpc.error_of(message["error"]))
        else:
            answer.set_result(result)


class Client:
    """One connection to a daemon, for one thread, with the methods of a `Controller`.

    Parameters
    ----------
    line
        To the daemon, or to a worker of this process.
    interrupts
        Let through while it works, unless something falls.
    """

    def __init__(self, line: Line, interrupts: Interrupts | None = None) -> None:
        self._interrupts = Interrupts() if interrupts is None else interrupts
        self._session: Session | None = None
        self._armed = False
        self._closed = threading.Event()
        self.line = line

    def call(self, method: str, *, patience: float = _ANSWER_S, **params: Any) -> Any:
        """Ask for anything in the interface, see API.md.

        Parameters
        ----------
        method, **params
            As there.
        patience
            How long to wait for the answer, s.

        Raises
        ------
        RigError
            As the daemon raised it, or it is gone.
        """
        answer = self.line.ask(method, **params)
        silent = rig_error("daemon_no_answer", method=method)
        # What has fallen is recorded whole.
        with nullcontext() if method == "collect" else self._interrupts.let_through():
            return _result(answer, patience, silent)

    def take_control(self) -> None:
        """Take control and keep it until `close`.

        Raises
        ------
        ControlError
            Another client has it.
        """
        self.call("take_control")
        threading.Thread(target=self._renew, name="rig control", daemon=True).start()

    def _renew(self) -> None:
        while not self._closed.wait(_BEAT_S):
            # Armed, this thread's sign of life is not enough: the client must be at it.
            if not self._armed:
                self.line.ask("renew")

    # ------------------------------------------------------------------ what a rig does

    @property
    def session(self) -> Reader:
        """The open session, for reading."""
        if self._session is None:
            raise rig_error("no_session_open")
        return self._session

    def open_session(self, protocol: str, session: str, seed: int | None = None) -> Job | None:
        """Have a session opened, and open it for reading here."""
        source, path = str(Path(protocol).resolve()), Path(session).resolve()
        opened = self.call("open_session", protocol=source, session=str(path), seed=seed)
        self._session, fetched = Session.open(path, readonly=True), opened["fetched"]
        return fetched and Job(*fetched)

    def close_session(self) -> None:
        """Have the session closed."""
        self._let_go()
        self.call("close_session")

    def wait(self, seconds: float) -> None:
        """Have the device's clock watched for a while."""
        self.call("wait", seconds=seconds, patience=seconds + _ANSWER_S)

    def arm(self, run: int, attempt: int) -> int:
        """Arm; give the token."""
        token: int = self.call("arm", run=run, attempt=attempt)["token"]
        self._armed = True  # not before: an answer may take longer than a lease
        return token

    def fire(self, token: int) -> None:
        """Let go."""
        self._armed = False
        self.call("fire", token=token)

    def collect(self, run: int, attempt: int) -> Drop:
        """Wait until a drop is stored, and read it from the file."""
        self.call("collect", run=run, attempt=attempt, patience=2 * _ANSWER_S)
        drop = self.session.drop(run, attempt)
        if drop is None:
            raise rig_error("not_recorded", run=run, attempt=attempt)
        return drop

    def log_state(self, run: int, attempt: int, state: RunState, reasons: Reasons = ()) -> None:
        """Log a verdict."""
        records = [reason.record() for reason in reasons]
        self.call("log_state", run=run, attempt=attempt, state=str(state), reasons=records)

    def stop(self, reason: str) -> None:
        """Have everything switched off."""
        self._armed = False
        self.call("stop", reason=reason)

    def close(self) -> None:
        """Hang up; a drop that fell is recorded all the same."""
        self._let_go()
        self._closed.set()
        self.line.close()

    def _let_go(self) -> None:
        if self._session is not None:
            self._session.close()
            self._session = None


class AsyncClient:
    """One connection to a daemon; `replica` follows its state once it is subscribed.

    Attributes
    ----------
    line
        As for a `Client`.
    replica
        The state.
    changed
        Called whenever it has changed. It should only take a note: it is called often.
    lost
        Set when the connection has ended.
    """

    line: Line

    def __init__(self) -> None:
        self.replica = Replica()
        self.changed: Callable[[], None] = lambda: None
        self.lost = asyncio.Event()
        self._loop = asyncio.get_running_loop()

    @classmethod
    async def connect(cls, path: Path, name: str) -> Self:
        """Connect and shake hands.

        Parameters
        ----------
        path, name
            As for `Line`, which says what is raised.
        """
        client = cls()
        notify, end = partial(client._soon, client._follow), partial(client._soon, client._end)
        client.line = await client._loop.run_in_executor(None, Line, path, name, notify, end)
        return client

    async def call(self, method: str, **params: Any) -> Any:
        """Ask for anything in the interface, see API.md.

        Raises
        ------
        RigError
            As the daemon raised it, or it is gone.
        """
        return await asyncio.wrap_future(self.line.ask(method, **params))

    async def close(self) -> None:
        """Hang up."""
        self.line.close()
        self._end()

    def _soon(self, do: Callable[..., None], *values: object) -> None:
        """Have something done in the loop, in the order in which it came."""
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(do, *values)

    def _follow(self, method: str, params: dict[str, Any]) -> None:
        self.replica.follow(method, params)
        self.changed()

    def _end(self) -> None:
        self.lost.set()
        self.changed()


def _result(answer: Future[Any], patience_s: float, silent: RigError) -> Any:
    for _ in range(math.ceil(patience_s / _HEED_S)):
        if wait([answer], _HEED_S).done:
            return answer.result()
    raise silent


def _reach(path: Path) -> socket.socket:
    """Connect to a daemon of this user, in a folder where nobody else can have one.

    Raises
    ------
    DeviceError
        Nobody answers there.
    InputError
        The folder belongs to, or is open to, somebody else.
    BusyError
        Too many want to be let in.
    """
    with ExitStack() as stack:
        try:
            check_folder(path.parent)
            line = stack.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM))
            # More may want to be let in than the kernel keeps waiting.
            patience = struct.pack("@2l", round(_REACH_S), 0)
            line.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, patience)
            line.connect(str(path))
        except BlockingIOError as error:
            raise rig_error("daemon_busy", path=path, patience_s=_REACH_S) from error
        except OSError as error:
            raise rig_error("no_daemon", path=path, text=error) from error
        stack.pop_all()
    return line
