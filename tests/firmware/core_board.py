"""The firmware's core compiled for the host, with the face of `sim.board.VirtualBoard`."""

from __future__ import annotations

import _ctypes
import ctypes
import shutil
import tempfile
import weakref
from collections.abc import Iterable
from pathlib import Path

from rig.link import messages as wire
from rig.link.frames import Decoder
from sim.interfaces import Lab
from tests.firmware.toolchain import make

HZ = 16_000_000
BYTE_TICKS = 320
EXTERNAL_RESET, BROWN_OUT = 2, 4
_TURN_TICKS = 200


def build(streams: bool = False) -> Path:
    """Compile the core with the undefined-behaviour sanitizer in it."""
    name = "core-streams.so" if streams else "core.so"
    return make(f"build/host/{name}")


def load(library: Path) -> ctypes.CDLL:
    """Load it with a memory of its own: a firmware has but one, and no test may find another's."""
    with tempfile.TemporaryDirectory() as folder:
        return ctypes.CDLL(str(shutil.copy(library, folder)))


def to_ticks(ns: int) -> int:
    return ns * HZ // 10**9


def to_ns(ticks: int) -> int:
    return -(-ticks * 10**9 // HZ)


class Line:
    """What the device has sent, as `sim.transmitter.Transmitter` tells it."""

    byte_ns = to_ns(BYTE_TICKS)

    def __init__(self, board: CoreBoard) -> None:
        self._board = board
        self.waiting = bytearray()

    def next_arrival_ns(self) -> int | None:
        self._board.collect()
        if self.waiting:
            return self._board.now_ns
        next_tick = self._board.core.host_next_byte()
        return to_ns(next_tick) if next_tick else None

    def read(self, now_ns: int) -> bytes:
        self._board.collect()
        data = bytes(self.waiting)
        self.waiting.clear()
        return data


class CoreBoard:
    """The core behind gates."""

    def __init__(self, lab: Lab, *, streams: bool = False, start_tick: int = 0) -> None:
        self.lab = lab
        self.core = load(build(streams))
        weakref.finalize(self, _ctypes.dlclose, self.core._handle)
        for name in ("host_run", "host_fired", "host_next_byte"):
            getattr(self.core, name).restype = ctypes.c_uint64
        self.line = Line(self)
        self.now_ns = 0
        self.core.host_power(start_tick)
        self._start()

    def _start(self) -> None:
        self._requests = Decoder()
        self._label = 0

    def advance(self, until_ns: int) -> None:
        until = to_ticks(until_ns)
        while self.core.host_run(ctypes.c_uint64(until)) + _TURN_TICKS <= until:
            self._drop(self.core.host_fired())
        fired = self.core.host_fired()
        if fired:
            self._drop(fired)
        self.now_ns = max(self.now_ns, until_ns)

    def next_ns(self) -> int:
        """A main loop always has something to do."""
        return self.now_ns + 100_000

    def receive(self, start_ns: int, data: bytes) -> None:
        for frame in self._requests.feed(data):
            if frame.type == wire.CODES[wire.Arm] and len(frame.payload) >= 4:
                self._hang(int.from_bytes(frame.payload[:4], "little"))
        for byte in data:
            assert self.core.host_feed(ctypes.c_uint64(to_ticks(start_ns)), byte)

    def reset(self, at_ns: int, cause: int = EXTERNAL_RESET) -> None:
        self.advance(at_ns)
        self.line.waiting.clear()
        self.core.host_reset(cause)
        self._start()

    def brown_out(self, at_ns: int) -> None:
        self.reset(at_ns, BROWN_OUT)

    def touch(self, gates: int) -> None:
        self.core.host_gates(gates)

    def stop(self, opened: bool) -> None:
        self.core.host_stop(opened)

    def reference(self, times_ns: Iterable[int]) -> None:
        for at in times_ns:
            self.core.host_reference(ctypes.c_uint64(to_ticks(at)))

    def sense(self, seconds: float | None) -> None:
        self.core.host_sense(ctypes.c_uint64(round((seconds or 0) * HZ)))

    def preset(self, tick: int) -> None:
        self.core.host_preset(ctypes.c_uint32(tick))

    def outputs(self) -> int:
        return self.core.host_outputs()

    def collect(self) -> None:
        when = ctypes.c_uint64()
        while (byte := self.core.host_take(ctypes.byref(when))) >= 0:
            self.line.waiting.append(byte)

    def _hang(self, label: int) -> None:
        """Hang the chains when they are asked for, but not while others fall."""
        if not self.core.host_recording():
            self._label = label
            self.touch(self.lab.rest(label))

    def _drop(self, fired: int) -> None:
        for seconds, channel, blocked in self.lab.drop(self._label):
            at = fired + round(seconds * HZ)
            assert self.core.host_change(ctypes.c_uint64(at), channel, blocked)
