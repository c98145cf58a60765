"""A board under test, in virtual time, with hands around it."""

from dataclasses import dataclass, field

from rig.link.messages import pack_label
from sim.serial_port import SimulatedSerial

GATES = 0x0303
LABEL = pack_label(7, 1)


@dataclass
class ScriptedLab:
    """A lab whose drops are written down beforehand."""

    hanging: int = 0
    changes: list[tuple[float, int, bool]] = field(default_factory=list)
    drops: list[int] = field(default_factory=list)

    def rest(self, label: int) -> int:
        return self.hanging

    def drop(self, label: int) -> list[tuple[float, int, bool]]:
        self.drops.append(label)
        return self.changes


def falling_rods(rods: int = 10, start_s: float = 0.01) -> list[tuple[float, int, bool]]:
    """Write changes like those of two chains through two gates each; over after 0.11 s."""
    changes = []
    for channel, shift in ((0, 0.0), (1, 0.004), (8, 0.0007), (9, 0.0051)):
        for rod in range(rods):
            at = start_s + shift + 0.011 * rod - 0.0002 * rod**1.5
            changes += [(at, channel, True), (at + 0.002, channel, False)]
    return sorted(changes)


class Bench:
    """A board in virtual time and hands around it.

    `board` is a `sim.board.VirtualBoard` or has its face; `lab` is what its gates will see at the
    next ARM and FIRE. `tick_tolerance` is how far a stamp may be off besides the resonator's own
    error; `brown_out_cause` what BOOT says of a supply that sank; `can_sense` whether the board has
    an input for the release. A shorter touch than `touch_s` would tell it that a gate moved, but
    not which.
    """

    serial_type = SimulatedSerial
    touch_s = 0.0
    tick_tolerance = 1
    brown_out_cause = 4
    can_sense = True

    def __init__(self, lab: ScriptedLab, board, **line) -> None:
        self.lab, self.board = lab, board
        self.serial = self.serial_type("test", board=board, timeout=0.02, **line)

    def port(self):
        return self.serial

    def clock(self):
        return self.serial.clock

    def touch(self, gates):
        """Block exactly these gates now."""
        self.now().touch(gates)
        self.clock().sleep(self.touch_s)

    def reset(self):
        """Press the reset button; the power stays on."""
        self.board.reset(self.clock().now_ns())

    def brown_out(self):
        """Let the supply sink for a moment; the memory stays."""
        self.board.brown_out(self.clock().now_ns())

    def reopen(self):
        """Close the port and open it again, without a reset."""
        self.serial.close()
        self.serial = self.serial_type(
            "test", board=self.board, clock=self.clock(), timeout=0.02, reset_on_open=False
        )

    def preset_tick(self, seconds_before_wrap):
        """Set the board's counter to so long before it wraps."""
        now = self.board.counter.tick_at(self.clock().now_ns())
        self.board.counter.start += 2**32 - round(seconds_before_wrap * 16e6) - now

    def stop(self, opened):
        """Open or close the emergency stop now."""
        self.now().stop(opened)

    def reference(self, times):
        """Give pulses of the 1 Hz reference, so many seconds from now."""
        now_ns = self.clock().now_ns()
        self.now().reference(now_ns + round(seconds * 1e9) for seconds in times)

    def sense(self, seconds):
        """Change the release-sense input so long after the next FIRE."""
        self.board.sense(seconds)

    def outputs(self):
        """Mask of the release outputs that are on now."""
        return self.now().outputs()

    def now(self):
        """Bring the board up to the present."""
        self.board.advance(self.clock().now_ns())
        return self.board
