# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m rig_emulator.usb_bench [-o DIR]``: a Pico whose USB hangs a thousand times."""

from __future__ import annotations

import random
import statistics
import sys

from rig.link import messages as wire
from rig_emulator.boards_bench import show_page
from rig_emulator.stand import Stand
from rig_emulator.wiring import PICO, firmware_for

_MS = PICO.clock_hz // 1000
_HEAD = """\
# A Pico whose USB controller hangs

`./run bench usb`, in emulated time: erratum RP2040-E15 while a drop is held. 100 ms are the host's.

| | |
|---|---|
"""


def soak(hangs: int) -> dict[str, int]:
    """Let the controller hang so often while a drop is held; return what came of it, by name."""
    stand, chance = Stand(PICO, firmware_for(PICO)), random.Random(1)
    chip = stand.avr
    fire = stand.arm_and_fire(20, 0)[0]
    for n in range(32):
        chip.edge(fire + (n + 2) * _MS // 2, PICO.gates[n % 16], n < 16)
    certificate = [m for m in stand.hear(40 * _MS) if isinstance(m, wire.DropCertificate)][-1]
    ask = wire.Read(certificate.label, 0, 0)
    lost, back_ms = 0, []
    for _ in range(hangs):
        stand.send(chance.choice([wire.Status(), ask, wire.Read(certificate.label, 0, 14)]))
        chip.run(chip.cycle + chance.randrange(2 * _MS))
        chip.hang_usb(dead_s=chance.choice([0.0, 0.01, 0.2]))
        plugs, began = chip.usb["plugs"], chip.cycle
        while (ms := (chip.cycle - began) / _MS) < 2000:
            if chip.usb["plugs"] > plugs and chip.usb["ready"]:
                back_ms.append(ms)
                break
            chip.run(chip.cycle + _MS // 4)
        stand.hear(_MS)  # what was on its way
        lost += stand.ask(ask) != certificate
    return {
        "hangs": hangs,
        "mended": len(back_ms),
        "held drops lost": lost,
        "packets offered in the last fifth of a frame": chip.usb["late"],
        "ms to come back, median": round(statistics.median(back_ms)),
        "ms to come back, longest": round(max(back_ms)),
    }


def main() -> int:
    """Let it hang a thousand times."""
    seen = soak(1000)
    show_page("usb", _HEAD + "".join(f"| {name} | {value:,} |\n" for name, value in seen.items()))
    return int(seen["mended"] < seen["hangs"] or seen["held drops lost"] > 0)


if __name__ == "__main__":
    sys.exit(main())
