"""One state machine of PIO, clock by clock, written from the data sheet (3.2 to 3.4) for tests.

It shares nothing with the emulator: another language, no loop taken at one go, all registers plain.
"""

from dataclasses import dataclass, field

_WORD = 0xFFFFFFFF
SYNCHRONISER = 2
"""Clocks from a pin to what the machine reads."""


@dataclass
class Machine:
    """A machine at the first word of its loop, its FIFOs without a bottom."""

    program: list[int]
    wrap: tuple[int, int]  # where it goes back to, and from where
    in_base: int = 0
    jmp_pin: int = 0
    clock: int = 0
    pins: int = 0
    x: int = 0
    y: int = 0
    isr: int = 0
    osr: int = _WORD
    outputs: int = 0
    tx: list[int] = field(default_factory=list)
    rx: list[int] = field(default_factory=list)
    moved: list[tuple[int, int]] = field(default_factory=list)  # clock, outputs
    _delay: int = 0
    _seen: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.pc = self.wrap[0]
        self._seen = [self.pins] * SYNCHRONISER
        self.x = (self.pins & 0xFFFF) * 0x10001
        self.isr = self.x

    def run(self, until: int, edges: dict[int, int] | None = None) -> None:
        """Work up to a clock; `edges` are all pins from a clock on."""
        for clock in range(self.clock, until):
            self.pins = (edges or {}).get(clock, self.pins)
            self._seen.append(self.pins)
            seen = self._seen.pop(0)
            self.clock = clock
            if self._delay:
                self._delay -= 1
            else:
                self._step(seen)
        self.clock = until

    def _step(self, pins: int) -> None:
        word = self.program[self.pc]
        kind, delay, middle, low = word >> 13, word >> 8 & 31, word >> 5 & 7, word & 31
        after = self.wrap[0] if self.pc == self.wrap[1] else self.pc + 1
        if kind == 0:
            if self._jumps(middle, pins):
                after = low
        elif kind == 2:
            self._shift_in({0: pins >> self.in_base, 2: self.y}[middle], low)
        elif kind == 3:
            self._output(0b111, self.osr & (1 << low) - 1)
            self.osr >>= low
        elif kind == 4 and word & 0x80:
            if not self.tx:
                return
            self.osr = self.tx.pop(0)
        elif kind == 4:
            self.rx.append(self.isr)
            self.isr = 0
        elif kind == 5:
            value = {1: self.x, 2: self.y, 6: self.isr, 7: self.osr}[low]
            setattr(self, {1: "x", 2: "y", 6: "isr", 7: "osr"}[middle], value)
        else:
            self._output(0b011, low)
        self.pc, self._delay = after, delay

    def _jumps(self, condition: int, pins: int) -> bool:
        if condition == 2:
            taken, self.x = self.x != 0, self.x - 1 & _WORD
        elif condition == 4:
            taken, self.y = self.y != 0, self.y - 1 & _WORD
        else:
            taken = {0: True, 5: self.x != self.y, 6: bool(pins >> self.jmp_pin & 1)}[condition]
        return taken

    def _shift_in(self, value: int, bits: int) -> None:
        self.isr = (self.isr << bits | value & (1 << bits) - 1) & _WORD

    def _output(self, mask: int, value: int) -> None:
        new = self.outputs & ~mask | value & mask
        if new != self.outputs:
            self.moved.append((self.clock, new))
        self.outputs = new
