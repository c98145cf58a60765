# SPDX-License-Identifier: GPL-3.0-or-later
"""One emulated Pico: a process of node that runs rp2040js, and a pipe to it."""

from __future__ import annotations

import json
import shutil
import subprocess
import weakref
from contextlib import suppress
from itertools import groupby
from pathlib import Path
from typing import IO, Any

from rig.errors import InputError
from rig_emulator.controller import Change, EmulatorError, Sent, Stop

HERE = Path(__file__).parent / "pico"
RESET_PIN, POWER = 1 << 16, 1 << 8
"""Why the chip starts, as its register says."""
_WHY = {None: Stop.REACHED, "pin": Stop.PIN, "sent": Stop.SENT}


def need_pico() -> None:
    """See that there is what it needs.

    Raises
    ------
    InputError
        When node or rp2040js is missing.
    """
    if shutil.which("node") is None:
        raise InputError(
            "emu://?board=pico needs node, which is not here",
            "on Debian: apt-get install nodejs npm",
        )
    if not (HERE / "node_modules" / "rp2040js" / "package.json").is_file():
        raise InputError("emu://?board=pico needs rp2040js", f"install it: npm ci --prefix {HERE}")


class PicoChip:
    """An RP2040 with its program, stopped at cycle 0 after power-up. Nobody has opened its port.

    Parameters
    ----------
    program
        A UF2 file.
    number
        Of its flash chip: eight bytes.
    quick
        Take a state machine's loops at one go, which changes nothing but how long it takes.
    revision
        Of the chip: 2 is B2, 1 is B0 or B1.

    Attributes
    ----------
    cycle
        Cycles since power-up.
    watchdog_resets
        How often the watchdog has bitten.
    texts
        What its USB port calls itself: maker, product and serial number.
    usb
        Whether the port is `ready`; how many packets were offered `late` in a frame, how many
        acknowledgements were `lost`, how often the host `gaveUp` a request, and how often the
        device came to the bus (`plugs`), and went over to take firmware (`boots`).
    """

    def __init__(
        self, program: Path, number: bytes, *, quick: bool = True, revision: int = 2
    ) -> None:
        need_pico()
        self.cycle = self.watchdog_resets = self._outputs = self._watched = 0
        self.texts: list[str] = []
        self.usb: dict[str, int] = {}
        self._edges: list[tuple[int, int, int]] = []
        self._bytes: list[tuple[int, str]] = []
        self._changes: list[Change] = []
        self._sent: list[Sent] = []
        self._node = subprocess.Popen(
            ["node", HERE / "run.mjs", program, number.hex(), str(revision)],  # noqa: S607 - wherever node is
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,  # Ctrl-C is for the program that asks it
        )
        self.close = weakref.finalize(self, _end, self._node)
        self._order(quick=quick, open=False)

    # -- time

    def run(self, until: int, *, stop_on_sent: bool = False) -> Stop:
        """Let it work up to a cycle, or to a change of a watched pin, or to a packet of bytes.

        Raises
        ------
        EmulatorError
            When the firmware did something that is not modelled.
        """
        return _WHY[self._order(until=until, stopOnSent=stop_on_sent)["why"]]

    def reset(self) -> None:
        """Pull the reset pin; memory stays, and what comes on the wires."""
        self._order(reset=RESET_PIN)

    def brown_out(self) -> None:
        """Let the supply sink so far that it restarts; memory stays as it was."""
        self._order(reset=POWER)

    # -- pins

    def edge(self, cycle: int, pin: str, level: bool) -> None:
        """Give a pin a level from outside, from `cycle` on (what is over means now)."""
        self._edges.append((max(cycle, self.cycle), _number(pin), int(level)))

    def clear_edges(self, pin: str) -> None:
        """Forget the edges that are still to come at a pin."""
        self._edges = [edge for edge in self._edges if edge[1] != _number(pin)]
        self._order(clear=[_number(pin)])

    def watch(self, pin: str, on: bool = True) -> None:
        """Let `run` come back when this output changes."""
        bit = 1 << _number(pin)
        self._watched = self._watched | bit if on else self._watched & ~bit
        self._order(watched=self._watched)

    def output(self, pin: str) -> bool:
        """Whether the pin is driven high now."""
        return bool(self._outputs >> _number(pin) & 1)

    def take_changes(self) -> list[Change]:
        """Take what the releases and the sync output did since the last time."""
        taken, self._changes = self._changes, []
        return taken

    # -- USB

    def open(self, opened: bool = True) -> None:
        """Open its serial port, or close it."""
        self._order(open=opened)

    def receive(self, data: bytes, cycle: int = 0) -> None:
        """Send it bytes, not before `cycle`."""
        if data:
            self._bytes.append((cycle, data.hex()))

    def take_sent(self) -> list[Sent]:
        """Take what has come since the last time; bytes of a packet come together."""
        taken, self._sent = self._sent, []
        return taken

    def reads(self, on: bool) -> None:
        """Let the program that has opened its port stop reading, or go on."""
        self._order(reads=on)

    def rate(self, baudrate: float) -> None:
        """Tell it a baud rate."""
        self._order(rate=round(baudrate))

    def reset_bus(self) -> None:
        """Let the bus go, as a hub may, and ask it anew who it is."""
        self._order(resetBus=True)

    def hostile(self, *, loses: int = 0, gives_up: int = 0) -> None:
        """Lose each so many-th acknowledgement, give up each so many-th control transfer midway."""
        self._order(hostile={"loses": loses, "givesUp": gives_up})

    def hang_usb(self, *, dead_s: float = 0.0) -> None:
        """Let the controller hang (RP2040-E15), and take so long to come out of reset."""
        self._order(hang=True, deadNs=dead_s * 1e9)

    def busy_hub(self, on: bool) -> None:
        """Put it behind a hub so busy that an old chip misses the end of a bus reset (E5)."""
        self._order(hub=on)

    def sleep_bus(self, sleeps: bool) -> None:
        """Suspend the bus, or let it go on."""
        self._order(sleeps=sleeps)

    def clear_halts(self) -> None:
        """Clear the halts of both endpoints of the line: packets are counted from DATA0."""
        self._order(clearHalts=True)

    def set_interface(self) -> None:
        """Choose the line's interface anew, with the same effect."""
        self._order(setInterface=True)

    # -- DMA, for tests

    def dma_late(self, cycle: int) -> None:
        """Let DMA take no word before a cycle."""
        self._order(dmaLate=cycle)

    def wear(self, machine: int, left: int) -> None:
        """Let DMA have moved all but so many words of a state machine's."""
        self._order(wear=(machine, left))

    # -- memory, for tests

    def peek(self, address: int, size: int) -> bytes:
        """Read RAM."""
        return bytes.fromhex(self._order(peek=(address, address + size))["memory"])

    def poke(self, address: int, data: bytes) -> None:
        """Write RAM, two bytes at a time."""
        pairs = enumerate(memoryview(data).cast("H"))
        self._order(poke=[(address + 2 * n, value) for n, value in pairs])

    def ahead(self, turns: int) -> None:
        """Let the state machines that stamp have counted so many turns more."""
        self._order(ahead=turns)

    # -- inside

    def _order(self, **order: Any) -> dict[str, Any]:
        order["edges"], self._edges = self._edges, []
        if "until" in order:
            # Bytes that follow each other at once are one order.
            groups = groupby(self._bytes, key=lambda one: one[0])
            order["bytes"] = [(at, "".join(data for _, data in some)) for at, some in groups]
            self._bytes = []
        if self._node.stdin is None or self._node.stdout is None:  # pragma: no cover - pipes
            raise EmulatorError("the Pico's emulator has no pipes")
        try:
            _write(self._node.stdin, order)
            line = self._node.stdout.readline()
        except OSError:
            line = ""
        if not line:
            raise EmulatorError(f"the Pico's emulator ended (node: {self._node.poll()})")
        answer: dict[str, Any] = json.loads(line)
        self.cycle, self.watchdog_resets = answer["cycle"], answer["watchdogs"]
        self._outputs, self.texts, self.usb = answer["outputs"], answer["texts"], answer["usb"]
        self._changes += [Change(at, f"GP{pin}", bool(high)) for at, pin, high in answer["changes"]]
        for at, data in answer["sent"]:
            self._sent += [Sent(at, value) for value in bytes.fromhex(data)]
        if answer["fault"]:
            raise EmulatorError(f"the emulated Pico at cycle {self.cycle}: {answer['fault']}")
        return answer


def _write(pipe: IO[str], order: dict[str, Any]) -> None:
    pipe.write(json.dumps(order) + "\n")
    pipe.flush()


def _number(pin: str) -> int:
    if not pin.startswith("GP"):
        raise ValueError(f"no pin {pin!r} here")
    return int(pin.removeprefix("GP"))


def _end(node: subprocess.Popen[str]) -> None:
    """End node: it stops with its input, if something else has not ended it."""
    with suppress(BrokenPipeError), node:
        pass
