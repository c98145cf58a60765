"""Connection to the daemon, which is found or started, and reconnected when lost."""

import asyncio
import os
import sys
from collections.abc import Callable, Coroutine, Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from subprocess import DEVNULL, Popen
from time import monotonic
from typing import Any

from rig.daemon.client import AsyncClient
from rig.daemon.replica import Replica
from rig.daemon.socket_path import default_socket, prepare_folder
from rig.errors import DeviceError, RigError
from rig.reasons import rig_error
from rig.tui.state import DaemonState, read_state

_AGAIN_S = 0.5
_BEAT_S = 0.15  # time between heartbeats
_LATE_S = 0.02
_SILENT_S = 0.5  # longest time without an answer; a loss is noticed within a second
_START_S = 5.0  # time for a daemon to start before another is started
_IDLE_S = 300.0  # a daemon started from here ends after this time without clients


class ReconnectingClient:
    """A client of the daemon for as long as the screen is open.

    Parameters
    ----------
    url
        The port; empty to watch any running daemon.
    socket
        Socket of the daemon; `None` for the default.
    connected
        Awaited each time the daemon was reached and its state is known.

    Attributes
    ----------
    silence
        Why the daemon does not answer; empty while it does.
    daemon
        Process of a daemon started from here, if any.
    disk_s
        Duration of the daemon's present disk write, s; 0 for none.
    patience_s
        Longest time for an answer to a heartbeat, s.
    lost
        Why the port was last lost, for a message after it is back.
    is_trial
        Whether the started daemon simulates for this screen alone, and ends with it.
    in_the_way
        Port and process of a daemon with another port than the wanted; empty for none.
    """

    def __init__(
        self, url: str, socket: Path | None, connected: Callable[[], Coroutine[Any, Any, None]]
    ) -> None:
        self.url = url
        self.path = self._usual_path = socket or default_socket()
        self.name = f"rig tui {os.getpid()}"
        self.silence = "connecting"
        self.changed = self._wants_control = True
        self.lost: Mapping[str, Any] = {}
        self.in_the_way: tuple[str, int] | None = None
        self.disk_s = 0.0
        self.patience_s = _SILENT_S
        self._hangs = self._had_control = self.is_trial = False
        self._connected = connected
        self._client: AsyncClient | None = None
        self.daemon: Popen[bytes] | None = None
        self._started_at = -_START_S
        self._port = ""

    @property
    def idle(self) -> bool:
        """Whether no rig was requested or ever connected."""
        return not self.url and self._client is None

    @property
    def up(self) -> bool:
        """Whether the daemon answers."""
        return self._client is not None and not (self._client.lost.is_set() or self._hangs)

    @property
    def port(self) -> str:
        """Port as named by the daemon, or as requested."""
        return self._port or self.url

    @property
    def state(self) -> DaemonState:
        """Latest state of the daemon."""
        return read_state(self._sections)

    @property
    def _sections(self) -> Mapping[str, Any]:
        return self._client.replica.state if self._client else {}

    @property
    def driving(self) -> bool:
        """Whether this client has control."""
        control = self._sections.get("control")
        # On a busy machine control may lapse; unless another client takes it, our next call
        # restores it.
        return self.up and (control["client"] == self.name if control else self._had_control)

    @property
    def connection(self) -> AsyncClient:
        """The connection, to which requests go; the daemon's errors come from there.

        Raises
        ------
        DeviceError
            There is none at present.
        """
        if self._client is None:
            raise DeviceError(f"no daemon: {self.silence}", "reconnecting")
        return self._client

    async def take_control(self) -> None:
        """Take control, now and after each reconnection.

        Raises
        ------
        RigError
            Another client has it.
        """
        self._wants_control = True
        await self.connection.call("take_control")
        self._had_control = True

    async def release_control(self) -> None:
        """Release control permanently."""
        self._wants_control = self._had_control = False
        await self.connection.call("release_control")

    async def go_to(self, url: str, *, trial: bool = False) -> None:
        """Switch to the daemon of another port.

        Parameters
        ----------
        url
            The port.
        trial
            Whether to start a simulation for this screen alone, which ends with it.
        """
        await asyncio.to_thread(self.end_trial)
        usual = self._usual_path
        self.path = usual.with_name(f"trial-{os.getpid()}.sock") if trial else usual
        self.url, self.is_trial, self._started_at = url, trial, -_START_S
        self._wants_control, self.in_the_way, self.silence = True, None, "connecting"
        if self._client is not None:
            await self._client.close()
        self._client, self._port, self.changed = None, "", True

    def end_trial(self) -> None:
        """End the simulation that was started for this screen alone."""
        if self.is_trial and self.daemon is not None:
            self.daemon.terminate()
            self.daemon.wait()
            self.path.with_suffix(".log").unlink(missing_ok=True)
            self.daemon, self.is_trial = None, False

    async def keep(self) -> None:
        """Connect and reconnect until cancelled."""
        while True:
            try:
                await self._once()
            except RigError as error:
                self.silence = error.two_lines
            self.changed = True
            await asyncio.sleep(_AGAIN_S)

    async def _once(self) -> None:
        """Connect once, and stay connected as long as possible."""
        try:
            client = await AsyncClient.connect(self.path, self.name)
        except DeviceError as error:
            self.in_the_way = None
            self._start(error)
            return
        reached = None
        try:
            self._port = str(client.line.daemon["port"])
            if self.url and self._port != self.url:
                self.in_the_way = self._port, int(client.line.daemon["pid"])
                raise rig_error("daemon_port", port=self._port, wanted=self.url)
            client.changed = partial(self._note, client.replica)
            await client.call("subscribe")
            self._client, self.silence = client, ""
            if self._wants_control and self._sections.get("control") is None:
                with suppress(RigError):
                    await self.take_control()
            # In parallel with heartbeats: opening a session may take longer than control lasts.
            reached = asyncio.get_running_loop().create_task(self._connected())
            while not client.lost.is_set():
                await self._beat(client)
            self.silence = rig_error("daemon_ended").two_lines
        finally:
            self._hangs, self.disk_s = False, 0.0
            if reached is not None:
                reached.cancel()
            self._had_control = False
            await client.close()

    async def _beat(self, client: AsyncClient) -> None:
        """Send heartbeats, and check that they are answered."""
        begun = monotonic()
        answer = asyncio.ensure_future(client.call("renew"))
        while not answer.done():
            try:
                await asyncio.wait([answer], timeout=self.patience_s)
                await asyncio.sleep(_LATE_S)  # the answer may be waiting here
            except asyncio.CancelledError:
                answer.cancel()
                raise
            if not answer.done():
                self._hangs = self.changed = True
                values = {"waited_s": monotonic() - begun, "pid": client.line.daemon["pid"]}
                self.silence = rig_error("daemon_hangs", **values).two_lines
        if answer.exception() is None:
            self.changed |= self._hangs or self.disk_s > 0.0
            self._hangs, self.silence = False, ""
            self.disk_s = float(answer.result()["disk_s"])
            with suppress(TimeoutError):
                await asyncio.wait_for(client.lost.wait(), _BEAT_S)

    def _start(self, error: DeviceError) -> None:
        """Start a daemon that outlives this screen until it is idle."""
        if not self.url:
            raise error
        if monotonic() - self._started_at < _START_S:
            return
        self._started_at = monotonic()
        if self.daemon is not None:
            self.daemon.poll()  # reaps the previous process
        prepare_folder(self.path.parent)
        # Its last messages would otherwise be lost with the terminal.
        with self.path.with_suffix(".log").open("ab") as log:
            command = [sys.executable, "-m", "rig", "daemon", "--port", self.url]
            command += ["--idle-timeout", str(_IDLE_S), "--socket", str(self.path)]
            self.daemon = Popen(
                command, stdin=DEVNULL, stdout=log, stderr=log, start_new_session=True
            )
        self.silence = "starting the daemon"

    def _note(self, replica: Replica) -> None:
        self.changed = True
        error, link = replica.state.get("error"), replica.state.get("link")
        if error and link and link["state"] != "up":
            self.lost = error
