"""A daemon with a simulated rig, an operator's hands on the screen, and the screen as text."""

import io
import lzma
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from inspect import isawaitable
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from textual._compositor import Compositor
from textual.app import App
from textual.pilot import Pilot

from rig.campaign.machine import Flow, Stage
from rig.reasons import plain_reason
from rig.records import Job
from rig.tui.actions import ACTIONS
from rig.tui.app import RigApp
from rig.tui.context import Options
from tests.cli.lab import ROOT
from tests.tables import read_table
from tests.waiting import PATIENCE_S

PLAYS = read_table(__file__, "plays")
KEYS = {action.name: action.keys for action in ACTIONS}
_LOOKS = Path(__file__).with_name("looks.session.xz")


def kept_session(folder: Path) -> Path:
    """Write what ``rig run`` recorded of `tests.cli.lab.short` at ``sim://?seed=4``."""
    path = folder / "looks.session"
    path.write_bytes(lzma.decompress(_LOOKS.read_bytes()))
    return path


DAEMON = """\
import rig.daemon.lease, rig.daemon.worker
rig.daemon.lease.LEASE_S = 60.0
rig.daemon.worker._COMMIT_S = 0.5
from rig.cli import main
raise SystemExit(main())
"""
"""One that takes no screen for lost which a busy machine leaves no time for a sign of life, and
leaves other writers a gap soon."""


def flow_of(stage: str, job: Any = None, reasons: Any = (), **more: Any) -> Flow:
    """Make the flow that a row of ``moments.yaml`` says."""
    why = tuple(map(plain_reason, reasons))
    return Flow(Stage[stage], job and Job(*job), reasons=why, **more)


@dataclass
class Operator:
    """Somebody at the keys."""

    app: RigApp
    pilot: Pilot[None]

    async def press(self, *keys: str) -> None:
        await self.pilot.press(*keys)

    async def until(self, true: Callable[[], object]) -> None:
        """Wait for something to become true on the screen or behind it."""
        end = time.monotonic() + PATIENCE_S
        while not (await found if isawaitable(found := true()) else found):
            assert time.monotonic() < end, f"{self.app.model.flow}\n{text_of(self.app)}"
            await self.pilot.pause(0.05)

    async def play(self, name: str) -> None:
        """Do what ``plays.yaml`` says."""
        for line in PLAYS[name]:
            deed, _, words = line.partition(" ")
            await getattr(self, deed)(*filter(None, words.split(" | ")))

    async def type(self, text: str) -> None:
        await self.press(*text)

    async def press_until(self, text: str, key: str = "enter") -> None:
        """Press a key until a text stands on the screen."""
        await self.until(lambda: self._pressed(key, lambda: text in flat(self.app)))

    async def _pressed(self, key: str, true: Callable[[], bool]) -> bool:
        await self.press(key)
        return true()

    async def mean(self) -> None:
        """Say yes to what is asked, once it stands there to be read."""
        await self.until(lambda: self._pressed("enter", lambda: len(self.app.screen_stack) == 1))

    async def at(self, stage: Stage | str) -> None:
        await self.until(lambda: self.app.model.flow.stage is _stage(stage))

    async def arm(self, stage: Stage | str) -> None:
        """Arm, and again where a busy machine let board or daemon wait too long, until `stage`."""

        async def there() -> bool:
            if self.app.model.flow.stage is Stage.PREPARE:
                await self.press("enter")
            return self.app.model.flow.stage is _stage(stage)

        await self.until(there)

    async def open(self, dialog: str) -> None:
        await self.until(lambda: type(self.app.screen).__name__ == dialog)

    async def close(self) -> None:
        await self.until(lambda: len(self.app.screen_stack) == 1)

    async def stop(self, key: str) -> None:
        """Press a key and see that the daemon is asked to stop, and has done so."""
        async with listening(self) as called:
            await self.press(key)
            await self.until(lambda: "stop answered" in called)

    async def drive(self) -> None:
        await self.until(lambda: self.app.client and self.app.client.driving)

    async def verdict(self, word: str) -> None:
        await self.until(lambda: self.app.model.flow.verdict == word and self.app.model.flow.logged)

    async def see(self, *texts: str) -> None:
        """Wait until all of these stand on the screen, however lines are broken."""
        await self.until(lambda: all(text in flat(self.app) for text in texts))

    async def keep(self, *texts: str) -> None:
        """See texts, and wait until the session has what they say."""
        await self.see(*texts)
        await self.until(lambda: self.app.model.flow.logged)


def _stage(stage: Stage | str) -> Stage:
    return stage if isinstance(stage, Stage) else Stage[stage]


def flat(app: RigApp) -> str:
    return re.sub(r"\s+", " ", text_of(app))


@asynccontextmanager
async def at_screen(options: Options, size=(80, 24), **of_client: Any) -> AsyncIterator[Operator]:
    """Sit down at a screen, whose client has other attributes."""
    app = RigApp(options, KEYS)
    for attribute, other in of_client.items():
        setattr(app.client, attribute, other)
    async with app.run_test(size=size) as pilot:
        yield Operator(app, pilot)


@asynccontextmanager
async def listening(op: Operator) -> AsyncIterator[list[str]]:
    """Hear what the daemon is asked for, and what it has answered."""
    connection = op.app.client.connection
    called, real = [], connection.call

    async def call(method: str, **params: Any) -> Any:
        if method == "renew":
            return await real(method)
        called.append(method)
        answer = await real(method, **params)
        called.append(f"{method} answered")
        return answer

    connection.call = call
    yield called
    connection.call = real


@dataclass
class Lab:
    """One bench with its daemon."""

    folder: Path
    protocol: Path
    url: str = "sim://?seed=3"
    patience_s: float = PATIENCE_S
    """With a daemon that other programs hold up."""
    daemons: list[subprocess.Popen[bytes]] = field(default_factory=list)

    @property
    def socket(self) -> Path:
        return self.folder / "rig.sock"

    @property
    def session(self) -> Path:
        return self.folder / "test.session"

    def start(self) -> None:
        """Start the daemon, and wait until it says that it is there."""
        command = [sys.executable, "-c", DAEMON, "daemon", "--port", self.url]
        daemon = subprocess.Popen(
            [*command, "--socket", str(self.socket)], cwd=ROOT, stderr=subprocess.PIPE
        )
        self.daemons.append(daemon)
        assert daemon.stderr is not None
        assert daemon.stderr.readline().startswith(b"rig daemon: ")

    def restart(self) -> None:
        """End it, and start one that is otherwise."""
        self.stop()
        self.daemons.clear()
        self.start()

    def kill(self) -> None:
        """Kill it as a crash would."""
        daemon = self.daemons[-1]
        daemon.kill()
        daemon.wait()

    def stop(self) -> None:
        for daemon in self.daemons:
            with suppress(ProcessLookupError):
                os.kill(daemon.pid, signal.SIGTERM)
            daemon.wait(PATIENCE_S)
            if daemon.stderr is not None:
                daemon.stderr.close()

    @asynccontextmanager
    async def operator(
        self,
        size: tuple[int, int] = (80, 24),
        countdown_s: float = 0.2,
        name: str = "",
        files: tuple[Path, ...] = (),
    ) -> AsyncIterator[Operator]:
        """Sit down at a screen."""
        options = Options(
            files or (self.protocol,),
            self.url,
            self.session,
            socket=self.socket,
            countdown_s=countdown_s,
            still_s=0.0,
        )
        named = {"name": name} if name else {}
        async with at_screen(options, size, patience_s=self.patience_s, **named) as operator:
            client = operator.app.client
            await operator.until(lambda: operator.app.model.page)
            yield operator
            if client.daemon:
                self.daemons.append(client.daemon)

    @asynccontextmanager
    async def ready(
        self, size: tuple[int, int] = (80, 24), countdown_s: float = 0.2
    ) -> AsyncIterator[Operator]:
        """Sit down with the first run prepared."""
        async with self.operator(size, countdown_s) as operator:
            await operator.until(lambda: operator.app.desk.chosen)
            await session_on(operator)
            await operator.press("enter")
            await operator.at(Stage.PREPARE)
            yield operator


async def session_on(op: Operator) -> None:
    """Have a session on the disk, and all that is known of its board shown."""
    await op.drive()
    await op.press("enter")
    await op.at(Stage.DEVICE)
    await op.until(lambda: op.app.model.view and op.app.model.indicators.known)


def unseen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have a screen drawn only when a test looks: the terminal of an app under test shows nothing.

    `tests/tui/test_terminal.py` has one that is drawn whenever something changes.
    """
    draw = Compositor.render_update

    def drawn(compositor: Compositor, full: bool = False, **more: Any) -> object:
        if full:
            return draw(compositor, full, **more)
        compositor._dirty_regions.clear()
        return None

    monkeypatch.setattr(Compositor, "render_update", drawn)


def draw_without_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have figures drawn as soon as their data are there, and looked at as soon."""
    for module in ("rig.tui.widgets.spans", "bench.pictures"):
        monkeypatch.setattr(f"{module}.PAUSE_S", 0.05)


def text_of(app: App[object]) -> str:
    """Write what stands on the screen, one line a row, without blanks at the ends."""
    return "\n".join(line.rstrip() for line in _printed(app).export_text().splitlines())


def colours_of(app: App[object]) -> Iterator[tuple[str, tuple[int, ...], tuple[int, ...]]]:
    """Tell every piece of text on the screen with the colours of ink and paper."""
    for segment in _printed(app)._record_buffer:
        style = segment.style
        if segment.text.strip() and style and style.color and style.bgcolor:
            yield segment.text, tuple(style.color.triplet), tuple(style.bgcolor.triplet)


def _printed(app: App[object]) -> Console:
    width, height = app.size
    console = Console(width=width, height=height, file=io.StringIO(), record=True,
                      force_terminal=True, legacy_windows=False)  # fmt: skip
    stack = app._background_screens
    console.print(app.screen._compositor.render_update(full=True, screen_stack=stack))
    return console
