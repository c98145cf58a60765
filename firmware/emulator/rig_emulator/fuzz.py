# SPDX-License-Identifier: GPL-3.0-or-later
"""A long time of anything at all before each board: ``python -m rig_emulator.fuzz``.

Requests right, wrong, repeated and garbled, noise, edges, the emergency stop, resets and brown-outs
come in random order; on USB the host also closes its port, stops reading and resets the bus. Every
pulse of the release is judged by what was said before it.
"""

from __future__ import annotations

import argparse
import random
import sys
from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

from rig.link import messages as wire
from rig.link.frames import Decoder, Frame, encode
from rig_emulator.stand import powered
from rig_emulator.wiring import BOARDS, PICO, firmware_for

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from rig_emulator.controller import Change
    from rig_emulator.wiring import Wiring

_SPARE_US = 30  # by which the shortest pulses may be longer than ordered
_SLOWER = 100  # times is the Pico's emulator
_LABELS = (1, 2, 0x10001)
_PULSES_US = (0, 5, 100, 4_000, 20_000)


class Pulse(NamedTuple):
    """An output that went on."""

    pin: str
    since: int
    limit: int


class Judge:
    """Knows which pulses were asked for.

    Parameters
    ----------
    releases
        The pins of the outputs.
    us
        Cycles in a microsecond.

    Attributes
    ----------
    faults
        Pulses that nobody asked for, or that were too long.
    pulses
        How many there were, by what ended them: "ordered" or "cut".
    """

    def __init__(self, releases: tuple[str, ...], us: int) -> None:
        self._us, self._spare = us, _SPARE_US * us
        self.faults: list[str] = []
        self.pulses: Counter[str] = Counter()
        self._releases = releases
        self._granted: tuple[int, wire.Arm] | None = None  # the latest token
        self._fired: set[int] = set()  # tokens of all FIREs since the last restart
        self._used: tuple[int, int] | None = None  # token and cycle of the drop that goes on
        self._on: dict[str, Pulse] = {}

    def armed(self, token: int, order: wire.Arm) -> None:
        """Take what the board granted."""
        self._granted = token, order

    def fire(self, token: int) -> None:
        """Take that FIRE was sent, whole."""
        self._fired.add(token)

    def restarted(self) -> None:
        """Take that every token is void."""
        self._granted = self._used = None
        self._fired.clear()

    def change(self, change: Change) -> None:
        """Take what an output did."""
        if change.pin not in self._releases:
            return
        if not change.high:
            if pulse := self._on.pop(change.pin, None):
                length = change.cycle - pulse.since
                self.pulses["ordered" if abs(length - pulse.limit) <= self._spare else "cut"] += 1
                if length > pulse.limit + self._spare:
                    self.faults.append(f"{pulse.pin} was on for {length} cycles at {pulse.since}")
            return
        limit = self._allowed(change)
        if limit is None:
            self.faults.append(f"{change.pin} went on at {change.cycle} without ARM and FIRE")
        self._on[change.pin] = Pulse(change.pin, change.cycle, limit or 0)

    def _allowed(self, change: Change) -> int | None:
        """Say for how many cycles an output may be on that goes on now; `None`: not at all."""
        if self._granted is None:
            return None
        token, order = self._granted
        if token not in self._fired or not order.release >> self._releases.index(change.pin) & 1:
            return None
        if self._used is not None and self._used[0] == token and self._used[1] != change.cycle:
            return None  # one token, one drop: all its outputs go on together
        self._used = token, change.cycle
        return order.pulse_us * self._us


class Fuzz:
    """One board, and all that happens to it.

    Parameters
    ----------
    wiring, program
        The board.
    seed
        Same seed, same happenings.

    Attributes
    ----------
    judge
        What it thinks of the release.
    happened
        How often what was done, and what the board answered.
    """

    def __init__(self, wiring: Wiring, program: Path, seed: int) -> None:
        self.wiring = wiring
        self.avr = powered(wiring, program, 500_000, b"any name")
        self._us = wiring.clock_hz // 1_000_000
        self._ms = 1000 * self._us
        self.judge = Judge(wiring.releases, self._us)
        self.happened: Counter[str] = Counter()
        self._chance = random.Random(f"fuzz {wiring.mcu} {seed}")
        self._decoder = Decoder()
        self._seq = 0
        self._token = 0
        self._asked: dict[int, wire.Arm] = {}
        self._held = wire.Acknowledge(1, 0)
        self._last = b""
        self._settle()
        self.run(50 * self._ms)

    def step(self) -> None:
        """Let one thing happen."""
        doings: dict[str, tuple[float, Callable[[], None]]] = {
            "request": (4, self._request),
            "drop": (3, self._drop),
            "ARM": (2, self._arm),
            "FIRE": (4, self._fire),
            "acknowledge": (3, lambda: self._say(self._held)),
            "repeat": (1, self._repeat),
            "garbled": (1, self._garbled),
            "noise": (1, self._noise),
            "edges": (1, self._edges),
            "stop": (0.4, self._stop),
            "rest": (3, self._settle),
            "reset": (0.15, self._reset),
            "brown-out": (0.15, self._brown_out),
        }
        if self.wiring is PICO:
            doings |= {
                "port": (0.3, self._close_and_open),
                "unread": (0.5, self._stop_reading),
                "bus reset": (0.15, self._reset_bus),
            }
        (what,) = self._chance.choices(list(doings), [weight for weight, _ in doings.values()])
        self.happened[what] += 1
        doings[what][1]()
        self.run(round(self._ms * self._chance.choice((0.2, 1, 3, 10, 40, 100))))

    def run(self, cycles: int) -> None:
        """Let it work, and hear and see what it does."""
        end = self.avr.cycle + cycles
        while self.avr.run(end):
            pass
        sent = bytes(one.value for one in self.avr.take_sent())
        for frame in self._decoder.feed(sent):
            self._heard(frame.ack, wire.unpack(frame.type, frame.payload))
        for change in self.avr.take_changes():
            self.judge.change(change)

    def _heard(self, ack: int, message: wire.Message) -> None:
        match message:
            case wire.Armed(token=token) if ack in self._asked:
                self._token = token
                self.judge.armed(token, self._asked[ack])
            case wire.DropCertificate():
                self._held = wire.Acknowledge(message.label, message.crc32)
            case wire.Refused():
                self.happened[f"refused {message.reason.name}"] += 1
            case wire.Boot():
                self.judge.restarted()

    def _say(self, message: wire.HostMessage, spoil: int = 0) -> None:
        self._seq = self._seq % 255 + 1
        code, payload = wire.pack(message)
        data = bytearray(b"\0" + encode(Frame(code, self._seq, 0, payload)))
        if isinstance(message, wire.Arm):
            self._asked[self._seq] = message
        if spoil:
            data[self._chance.randrange(1, len(data) - 1)] ^= spoil
        elif isinstance(message, wire.Fire):
            self.judge.fire(message.token)
        self._last = bytes(data)
        self.avr.receive(self._last)

    def _any_arm(self) -> wire.Arm:
        gates = (1 << len(self.wiring.gates)) - 1
        pulse_us = self._chance.choice(_PULSES_US)
        release = self._chance.randrange(1, 4) if pulse_us else 0
        mask = self._chance.choice((1, gates, 1 << self._chance.randrange(len(self.wiring.gates))))
        record_ms = self._chance.choice((1, 30, 100))
        return wire.Arm(self._chance.choice(_LABELS), mask, release, pulse_us, 200, record_ms)

    def _arm(self) -> None:
        self._say(self._any_arm())

    def _drop(self) -> None:
        """Do as a client does; what happened before may still forbid it."""
        self._settle()
        for message in (self._held, self._any_arm()):
            self._say(message)
            self.run(3 * self._ms)
        self._say(wire.Fire(self._token))

    def _fire(self) -> None:
        wrong = self._chance.random() < 0.2
        self._say(wire.Fire(self._chance.getrandbits(32) if wrong else self._token))

    def _request(self) -> None:
        others = (wire.Ping(), wire.Status(), wire.Abort(), wire.Identify(), wire.Reference())
        self._say(self._chance.choice((*others, wire.Read(self._held.label, 0, 0))))

    def _repeat(self) -> None:
        self.avr.receive(self._last)

    def _garbled(self) -> None:
        fire = wire.Fire(self._token)
        self._say(self._chance.choice((fire, self._any_arm())), self._chance.randrange(1, 256))

    def _noise(self) -> None:
        self.avr.receive(self._chance.randbytes(self._chance.randrange(1, 60)))

    def _edges(self) -> None:
        at = self.avr.cycle
        for _ in range(self._chance.randrange(1, 200)):
            at += self._chance.randrange(10, 1250 * self._us)
            gate = self._chance.choice(self.wiring.gates)
            self.avr.edge(at, gate, self._chance.random() < 0.5)

    def _stop(self) -> None:
        self.avr.edge(0, self.wiring.stop, True)
        closed = self.avr.cycle + round(self._ms * self._chance.choice((0.05, 0.5, 5)))
        self.avr.edge(closed, self.wiring.stop, False)

    def _settle(self) -> None:
        for pin in (*self.wiring.gates, self.wiring.stop):
            self.avr.clear_edges(pin)
            self.avr.edge(0, pin, False)

    def _reset(self) -> None:
        self._restart(self.avr.reset)

    def _brown_out(self) -> None:
        self._restart(self.avr.brown_out)

    def _close_and_open(self) -> None:
        self.avr.open(False)
        self._wait_a_while()
        self.avr.open(True)

    def _stop_reading(self) -> None:
        self.avr.reads(False)
        for _ in range(self._chance.randrange(40)):
            self._chance.choice((self._request, self._fire))()
        self._wait_a_while()
        self.avr.reads(True)

    def _reset_bus(self) -> None:
        self._wait_a_while()
        self.avr.reset_bus()

    def _wait_a_while(self) -> None:
        self.run(self._chance.randrange(1, 400 * self._ms))

    def _restart(self, how: Callable[[], None]) -> None:
        self.run(self._chance.randrange(1, 3 * self._ms))
        how()
        self._decoder = Decoder()
        for change in self.avr.take_changes():
            self.judge.change(change)
        self.judge.restarted()


def main() -> int:
    """Count what happened and the pulses that came of it."""
    parser = argparse.ArgumentParser(prog="python -m rig_emulator.fuzz", description=__doc__)
    parser.add_argument("--steps", type=int, default=200_000, help="happenings for each board")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    code = 0
    for name, wiring in {**BOARDS, "pico": PICO}.items():
        fuzz = Fuzz(wiring, firmware_for(wiring), options.seed)
        for _ in range(options.steps // (_SLOWER if wiring is PICO else 1)):
            fuzz.step()
        print(f"{name}: {fuzz.avr.cycle / wiring.clock_hz:.0f} s of the board's time")
        print(f"  pulses: {fuzz.judge.pulses.total()} {dict(fuzz.judge.pulses)}")
        print(f"  happened: {dict(fuzz.happened)}")
        print(f"  watchdog: {fuzz.avr.watchdog_resets}")
        for fault in fuzz.judge.faults:
            print(f"  {fault}")
            code = 1
    return code


if __name__ == "__main__":
    sys.exit(main())
