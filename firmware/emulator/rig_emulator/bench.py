# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m rig_emulator.bench``: how well boards stamp, beside ordinary sketches.

Everything is counted in cycles of the emulated controller, so it is the same on every machine.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from rig.errors import DeviceError
from rig.protocol import reader
from rig_emulator import rivals, trials
from rig_emulator.stand import Flip, Stand
from rig_emulator.wiring import BOARDS, PICO, firmware_for
from sim.dials import read_dials
from sim.lab import ChainLab

if TYPE_CHECKING:
    from rig_emulator.trials import Spread
    from rig_emulator.wiring import Wiring

_ROOT = Path(__file__).parents[3]
_SCENE = _ROOT / "protocols" / "inclined-uniform.yaml"
_DROPS = 10
_RATES = range(3000, 9001, 500)
_US = 16.0


def _row(name: str, seen: Spread, lost: int, us: float = _US) -> str:
    """One line of the table, in µs of so many cycles."""
    trusted = f"{seen.worst_trusted / us:9.3f}" if seen.doubtful else "        –"
    return (
        f"{name:28}{seen.count:7}{lost:6}{seen.mean / us:9.3f}{seen.sd / us:9.3f}"
        f"{seen.p99 / us:9.3f}{seen.worst / us:9.3f}{seen.doubtful:9}{trusted}"
    )


def _drops(wiring: Wiring, lab: ChainLab) -> list[list[Flip]]:
    return [trials.lab_flips(wiring, lab, run) for run in range(1, _DROPS + 1)]


def _own(wiring: Wiring, drops: list[list[Flip]]) -> None:
    """Begin a table with this firmware."""
    print(f"\n{wiring.mcu}: {_DROPS} drops of both chains; stamp less edge, in µs")
    heads = ("edges", "lost", "mean", "sd", "p99", "worst", "doubtful", "trusted")
    print(" " * 28 + f"{heads[0]:>7}{heads[1]:>6}" + "".join(f"{h:>9}" for h in heads[2:]))
    stand = Stand(wiring, firmware_for(wiring))
    stamps = [stamp for flips in drops for stamp in stand.stamps_of(flips)]
    print(_row("the rig's firmware", trials.spread(stamps), 0, wiring.clock_hz / 1e6))


def _pico(lab: ChainLab, folder: Path) -> None:
    """Print the Pico's table; `./run bench boards` has its limits."""
    drops = _drops(PICO, lab)
    _own(PICO, drops)
    program = rivals.compile_for_pico(folder)
    accounts = [rivals.drop_of_pico(program, flips) for flips in drops]
    stamps = [stamp for account in accounts for stamp in account.stamps]
    lost = sum(account.lost for account in accounts)
    print(_row("polling its timer", trials.spread(stamps), lost, PICO.clock_hz / 1e6))


def _stamps(wiring: Wiring, lab: ChainLab, folder: Path) -> None:
    drops = _drops(wiring, lab)
    _own(wiring, drops)
    for name in rivals.SKETCHES:
        program = rivals.compile_sketch(name, wiring.mcu, folder)
        accounts = [rivals.drop(wiring, program, flips) for flips in drops]
        stamps = [stamp for account in accounts for stamp in account.stamps]
        print(_row(name, trials.spread(stamps), sum(account.lost for account in accounts)))


def _limits(wiring: Wiring) -> None:
    stand = Stand(wiring, firmware_for(wiring))
    across = trials.across_halves(stand, 200)
    worst = max(abs(stamp.error) for stamp in across)
    print(f"  an edge at each of {len(across)} cycles about the counter's turn: {worst} off, worst")
    count = 3000 if stand.identity.streams else stand.identity.capacity
    whole = [rate for rate in _RATES if trials.sustained(stand, count, rate) == (count, 0)]
    print(f"  {count} edges with nothing lost at 500 kbaud: up to {max(whole, default=0)}/s")
    try:
        burst = trials.burst(stand, 250, 100_000)
        print(f"  250 edges at 100,000/s: {len(burst)} arrived")
    except DeviceError as error:  # too many for a small board's memory
        print(f"  250 edges at 100,000/s: {error}")
    shortest = next(w for w in range(1, 400) if trials.pulse(stand, 0, w)[1] == 0)
    print(f"  pulses of {shortest / _US:.2f} µs and longer are timed, shorter ones counted")
    print(f"  stack never used: {stand.avr.stack_free()} bytes")


def main() -> int:
    """Print the tables."""
    lab = ChainLab(reader.read(str(_SCENE)), read_dials({}), seed=1)
    with TemporaryDirectory() as folder:
        for wiring in BOARDS.values():
            _stamps(wiring, lab, Path(folder))
            _limits(wiring)
        _pico(lab, Path(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())
