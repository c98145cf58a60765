"""A blocking client of the daemon, for the runner and for scripts; without asyncio."""

from __future__ import annotations

import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.daemon import rpc
from rig.daemon.client_protocol import (
    HELLO_PATIENCE_S,
    ClientProtocol,
    gone,
    hello,
    silent,
    turned_away,
)
from rig.daemon.lease import LEASE_S, ControlError
from rig.daemon.socket_path import reach
from rig.errors import DeviceError, DeviceTimeoutError
from rig.reasons import make_error
from rig.recorder.interrupts import Interrupts
from rig.session.store import Session

if TYPE_CHECKING:
    from rig.reasons import Reason
    from rig.records import Drop
    from rig.session.reading import Reader
    from rig.session.schema import RunState

_LOOK_S = 0.1  # a signal waits no longer than this
_ANSWER_S = 100.0  # everything but waiting is over by then, a recording too, or the daemon hangs


class Client:
    """One connection to a daemon, for one thread, with the methods of a `Controller`.

    Parameters
    ----------
    path
        The daemon's Unix socket; beside it the file that stands for TCP.
    name
        What others are told of this client.
    interrupts
        Let through while the daemon works, and kept waiting inside a message.

    Raises
    ------
    DeviceError
        No daemon there.
    VersionError
        It speaks another version.
    """

    def __init__(self, path: Path, name: str, interrupts: Interrupts | None = None) -> None:
        self._interrupts = Interrupts() if interrupts is None else interrupts
        self._protocol = ClientProtocol()
        self._writing = threading.Lock()
        self._session: Session | None = None
        self._armed = False
        self._over = threading.Event()
        self._beat: threading.Thread | None = None
        self._socket, token = reach(path)
        self._socket.settimeout(_LOOK_S)
        try:
            self.daemon: dict[str, Any] = self.call(
                "hello", patience=HELLO_PATIENCE_S, **hello(name, token)
            )
        except DeviceTimeoutError:
            self._socket.close()
            raise silent(path) from None
        except BaseException:
            self._socket.close()
            raise

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
        number, line = self._protocol.ask(method, params)
        with self._interrupts.held():
            self._send(line)
        until = time.monotonic() + patience
        while True:
            with self._interrupts.held():
                for message in self._receive():
                    ours = message.get("id") == number and "method" not in message
                    if ours or turned_away(message):
                        return rpc.result_of(message)
            if time.monotonic() > until:
                raise make_error(DeviceTimeoutError, "daemon_no_answer", method=method)

    def take_control(self) -> None:
        """Take control and keep it until `close`.

        Raises
        ------
        ControlError
            Another client has it.
        """
        self.call("take_control")
        if self._beat is None:
            self._beat = threading.Thread(target=self._renew, name="sign of life", daemon=True)
            self._beat.start()

    # ------------------------------------------------------------------ what a rig does

    @property
    def session(self) -> Reader:
        """The open session, for reading."""
        if self._session is None:
            raise make_error(ControlError, "no_session_open")
        return self._session

    def open_session(
        self, protocol: str, session: str, seed: int | None = None
    ) -> tuple[int, int] | None:
        """Have a session opened, and open it for reading here."""
        path = Path(session).resolve()
        opened = self.call(
            "open_session", protocol=str(Path(protocol).resolve()), session=str(path), seed=seed
        )
        self._session = Session.open(path, readonly=True)
        fetched = opened["fetched"]
        return None if fetched is None else (fetched[0], fetched[1])

    def close_session(self) -> None:
        """Have the session closed."""
        self._let_go()
        self.call("close_session")

    def wait(self, seconds: float) -> None:
        """Have the device's clock watched for a while."""
        self.call("wait", seconds=seconds, patience=seconds + _ANSWER_S)

    def arm(self, run: int, attempt: int) -> int:
        """Arm; give the token."""
        # Armed, the thread's sign of life is not enough: this client must be at it.
        self._armed = True
        try:
            token: int = self.call("arm", run=run, attempt=attempt)["token"]
        except BaseException:
            self._armed = False
            raise
        return token

    def fire(self, token: int) -> None:
        """Let go."""
        try:
            self.call("fire", token=token)
        finally:
            self._armed = False

    def collect(self, run: int, attempt: int) -> Drop:
        """Wait until a drop is stored, and read it from the file."""
        self.call("collect", run=run, attempt=attempt, patience=2 * _ANSWER_S)
        drop = self.session.drop(run, attempt)
        if drop is None:
            raise make_error(DeviceError, "not_recorded", run=run, attempt=attempt)
        return drop

    def log_state(
        self, run: int, attempt: int, state: RunState, reasons: tuple[Reason, ...] = ()
    ) -> None:
        """Log a verdict."""
        records = [reason.record() for reason in reasons]
        self.call("log_state", run=run, attempt=attempt, state=str(state), reasons=records)

    def stop(self, reason: str) -> None:
        """Have everything switched off."""
        self._armed = False
        self.call("stop", reason=reason)

    def close(self) -> None:
        """Hang up; a drop that fell is recorded all the same."""
        self._over.set()
        self._let_go()
        self._socket.close()
        if self._beat is not None:
            self._beat.join()

    # ------------------------------------------------------------------ the line

    def _let_go(self) -> None:
        if self._session is not None:
            self._session.close()
            self._session = None

    def _renew(self) -> None:
        line = rpc.request("renew", {}, None)
        while not self._over.wait(LEASE_S / 4):
            if not self._armed:
                with suppress(DeviceError):
                    self._send(line)

    def _send(self, line: bytes) -> None:
        try:
            with self._writing:
                self._socket.sendall(line)
        except OSError as error:
            raise gone(error) from error

    def _receive(self) -> list[dict[str, Any]]:
        """Take what has come within `_LOOK_S`."""
        try:
            data = self._socket.recv(1 << 16)
        except TimeoutError:
            return []
        except OSError as error:
            raise gone(error) from error
        return self._protocol.feed(data)
