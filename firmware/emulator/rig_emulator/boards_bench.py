# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m rig_emulator.boards_bench [-o DIR]``: Mega and Pico side by side, in one table.

Everything is counted in cycles of the emulated controllers, so it is the same on every machine.
"""

from __future__ import annotations

import argparse
import subprocess
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rig.boards import BOARDS as SAID
from rig.errors import DeviceError
from rig.files import write_atomic
from rig_emulator import trials
from rig_emulator.pico_chip import PicoChip
from rig_emulator.stand import Flip, Stand
from rig_emulator.wiring import BOARDS, PICO, Wiring, firmware_for

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_COMPARED = {"Mega 2560": BOARDS["mega"], "Pico": PICO}
_RATES = (1e4, 2e4, 3e4, 5e4, 7e4, 1e5, 2e5, 5e5, 1e6, 2e6)
_BURSTS = (5e4, 1e5, 1e6, 2e6, 5e6, 6.6e6)
_EDGES = 900
_BURST = 250
_PULSES_NS = (*range(10, 200, 10), *range(200, 5000, 100))
_TIMES = 16
_RODS_EDGES = 3200
"""Of 100 rods at 16 gates."""
_FALL_S = 0.5
_HEAD = """\
# Both boards in their emulators

`./run bench boards`, in emulated time. [Which board to buy](../boards.md), and what is unproven.

"""


class Bench:
    """A board and what is measured on it."""

    def __init__(self, wiring: Wiring) -> None:
        self.wiring = wiring
        self.stand = Stand(wiring, firmware_for(wiring))
        self.us = wiring.clock_hz / 1e6

    def rows(self) -> Iterator[tuple[str, str]]:
        """Measure, one row of the table after another."""
        seen = trials.spread(self.stand.stamps_of(self._train(1500.0)))
        yield "stamp, standard deviation", f"{1e3 * seen.sd / self.us:.0f} ns"
        yield "stamp, 99 % within", f"{1e3 * seen.p99 / self.us:.0f} ns"
        yield "stamp, worst", f"{1e3 * seen.worst / self.us:.0f} ns"
        sustained = self._fastest(_RATES, self._sustained)
        yield f"{_EDGES} edges of all gates by chance, a second", f"{sustained:,.0f}"
        full = partial(self._sustained, count=self.stand.identity.capacity - 24)
        yield "edges until its memory is full, a second", f"{self._fastest(_RATES[6:], full):,.0f}"
        yield f"{_BURST} edges of one gate, a second", f"{self._fastest(_BURSTS, self._burst):,.0f}"
        one, two = self._closest(0), self._closest(len(self.wiring.gates) - 1)
        yield "shortest pulse that is always two edges", f"{one} ns"
        yield "two gates that are always two events", f"{two} ns"
        fired, skew, told = self._fire()
        yield "from sending FIRE to the release, the line included", f"{fired:.0f} µs"
        yield "between both releases", f"{skew:.0f} ns"
        yield f"from the end of a drop of {_EDGES} edges to its certificate", f"{told:.1f} ms"
        line = self._line(sustained)
        yield "bytes a second on the line, a burst to its certificate", f"{line:,.0f}"
        kept, told = self._rods()
        yield f"100 rods at 16 gates in {_FALL_S} s: edges kept of {_RODS_EDGES:,}", f"{kept:,}"
        yield "the same: from the end of the recording to the certificate", f"{told:.1f} ms"
        yield "from reset to BOOT, without a boot loader", f"{self._boot():.1f} ms"
        said = next(b for b in SAID.values() if b.name == self.stand.identity.board)
        yield "edges kept of a drop", f"{said.events:,}"
        yield "gates, releases", f"{said.gates}, {said.releases}"
        flash, memory = self._size()
        yield "flash, memory without the stack", f"{flash / 1024:.1f} KB, {memory / 1024:.1f} KB"

    def _train(self, rate: float, count: int = _EDGES) -> list[Flip]:
        return trials.train(len(self.wiring.gates), count, rate, hz=self.wiring.clock_hz)

    def _sustained(self, rate: float, count: int = _EDGES) -> bool:
        return len(self.stand.stamps_of(self._train(rate, count))) == count

    def _burst(self, rate: float) -> bool:
        return len(trials.burst(self.stand, _BURST, rate)) == _BURST

    def _fastest(self, rates: tuple[float, ...], whole: Callable[[float], bool]) -> float:
        best = 0.0
        for rate in rates:
            try:
                if not whole(rate):
                    break
            except DeviceError:  # an edge that left no event
                break
            best = rate
        return best

    def _closest(self, other: int) -> int:
        """Find the least ns between two edges, first of gate 0 and then of `other`."""
        for ns in _PULSES_NS:
            gap, flips = round(ns * self.us / 1e3), []
            for n in range(_TIMES):
                at = 200_000 + n * (60_000 + 7)
                flips += [Flip(at, 0, True), Flip(at + gap, other, other != 0)]
                if other:
                    back = at + 30_000
                    flips += [Flip(back, 0, False), Flip(back + gap, other, False)]
            recording = self.stand.record_all(flips)
            states = [event.state for event in recording.events]
            if len(states) == len(flips) and not recording.certificate.glitches:
                return int(ns)
        raise DeviceError("no two edges are far enough from each other")

    def _fire(self) -> tuple[float, float, float]:
        """Measure FIRE to release in µs, skew in ns, and the wait for the certificate in ms."""
        stand = self.stand
        stand.avr.take_sent()
        recording = stand.record_all(self._train(1500.0), pulse_us=1000)
        on = {c.pin: c.cycle for c in recording.outputs if c.high and c.pin != self.wiring.sync}
        first = min(on.values())
        low = next(c for c in recording.outputs if c.pin == self.wiring.sync and not c.high)
        return (
            (first + stand.fired - stand.fire_sent) / self.us,
            1e3 * (max(on.values()) - first) / self.us,
            (stand.certified - stand.fired - low.cycle) / self.us / 1e3,
        )

    def _line(self, rate: float) -> float:
        """Say how many bytes a second come of edges that come faster than they can be sent."""
        count = min(_RODS_EDGES, self.stand.identity.capacity - 24)
        flips, before = self._train(rate, count), self.stand.heard
        self.stand.stamps_of(flips)
        seconds = (self.stand.certified - self.stand.fired - flips[0].cycle) / self.us / 1e6
        return round((self.stand.heard - before) / seconds, -3)

    def _rods(self) -> tuple[int, float]:
        """Count the edges kept of a long drop, and wait for its certificate, in ms."""
        recording = self.stand.record_all(self._train(_RODS_EDGES / _FALL_S, _RODS_EDGES))
        low = next(c for c in recording.outputs if c.pin == self.wiring.sync and not c.high)
        wait = self.stand.certified - self.stand.fired - low.cycle
        return recording.certificate.events, wait / self.us / 1e3

    def _boot(self) -> float:
        chip = self.stand.avr
        began = chip.cycle
        chip.take_sent()
        chip.reset()
        while not (sent := chip.take_sent()):
            chip.run(began + self.wiring.clock_hz, stop_on_sent=True)
        return float((sent[0].cycle - began) / self.us / 1e3)

    def _size(self) -> tuple[int, int]:
        """Sum what the linker's account says, in bytes: flash, memory without the stack."""
        tool = "arm-none-eabi-size" if isinstance(self.stand.avr, PicoChip) else "avr-size"
        elf = firmware_for(self.wiring).with_suffix(".elf")
        told = subprocess.run([tool, "-A", elf], capture_output=True, text=True, check=True).stdout
        sizes = {
            line.split()[0]: int(line.split()[1]) for line in told.splitlines() if line[:1] == "."
        }
        flash = (".boot2", ".start", ".program", ".text", ".data")
        memory = (".program", ".data", ".bss", ".ring", ".kept", ".noinit")
        return sum(sizes.get(name, 0) for name in flash), sum(sizes.get(n, 0) for n in memory)


def page() -> str:
    """Measure both boards and write the page."""
    columns = {name: dict(Bench(wiring).rows()) for name, wiring in _COMPARED.items()}
    lines = [f"| | {' | '.join(columns)} |", "|---" * (len(columns) + 1) + "|"]
    for name in next(iter(columns.values())):
        cells = [column[name] for column in columns.values()]
        lines.append(f"| {' | '.join([name, *cells])} |")
    return _HEAD + "\n".join(lines) + "\n"


def show_page(name: str, text: str) -> None:
    """Print a page, or write it into the folder that the command line names."""
    parser = argparse.ArgumentParser(prog=f"rig_emulator.{name}_bench")
    parser.add_argument("-o", "--output", metavar="DIR", type=Path)
    folder = parser.parse_args().output
    if folder is None:
        print(text, end="")
    else:
        folder.mkdir(parents=True, exist_ok=True)
        write_atomic(folder / f"{name}.md", text)


if __name__ == "__main__":
    show_page("boards", page())
