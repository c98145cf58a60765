"""A device under test with hands around it, and that of a board in virtual time."""

from abc import ABC, abstractmethod
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


class Bench(ABC):
    """A device and its hands. `lab` is what its gates will see at the next ARM and FIRE.

    What a bench has no hand for it leaves as it is here, and the tests that need it are skipped.
    `tick_tolerance` is how far a stamp may be off besides the resonator's own error;
    `brown_out_cause` what BOOT says of a supply that sank.
    """

    tick_tolerance = 1
    brown_out_cause = 4
    can_preset_tick = False
    can_stop = False
    can_reference = False
    can_sense = False
    can_see_outputs = False

    def __init__(self, lab: ScriptedLab) -> None:
        self.lab = lab

    @abstractmethod
    def port(self): ...

    @abstractmethod
    def clock(self): ...

    @abstractmethod
    def touch(self, gates: int) -> None:
        """Block exactly these gates now."""

    @abstractmethod
    def reset(self) -> None:
        """Press the reset button; the power stays on."""

    def brown_out(self) -> None:
        """Let the supply sink for a moment; the memory stays."""
        raise NotImplementedError

    @abstractmethod
    def reopen(self) -> None:
        """Close the port and open it again, without a reset."""

    def preset_tick(self, seconds_before_wrap: float) -> None:
        """Set the device's counter to so long before it wraps."""
        raise NotImplementedError

    def stop(self, opened: bool) -> None:
        """Open or close the emergency stop now."""
        raise NotImplementedError

    def reference(self, times: list[float]) -> None:
        """Give pulses of the 1 Hz reference, so many seconds from now."""
        raise NotImplementedError

    def sense(self, seconds: float) -> None:
        """Change the release-sense input so long after the next FIRE."""
        raise NotImplementedError

    def outputs(self) -> int:
        """Mask of the release outputs that are on now."""
        raise NotImplementedError


class VirtualBench(Bench):
    """`board` is a `sim.board.VirtualBoard` or has its face.

    A shorter touch than `touch_s` would tell it that a gate moved, but not which.
    """

    serial_type = SimulatedSerial
    touch_s = 0.0
    can_preset_tick = can_stop = can_reference = can_sense = can_see_outputs = True

    def __init__(self, lab: ScriptedLab, board, **line) -> None:
        super().__init__(lab)
        self.board = board
        self.serial = self.serial_type("test", board=board, timeout=0.02, **line)

    def port(self):
        return self.serial

    def clock(self):
        return self.serial.clock

    def touch(self, gates):
        self.now().touch(gates)
        self.clock().sleep(self.touch_s)

    def reset(self):
        self.board.reset(self.clock().now_ns())

    def brown_out(self):
        self.board.brown_out(self.clock().now_ns())

    def reopen(self):
        self.serial.close()
        self.serial = self.serial_type(
            "test", board=self.board, clock=self.clock(), timeout=0.02, reset_on_open=False
        )

    def preset_tick(self, seconds_before_wrap):
        now = self.board.counter.tick_at(self.clock().now_ns())
        self.board.counter.start += 2**32 - round(seconds_before_wrap * 16e6) - now

    def stop(self, opened):
        self.now().stop(opened)

    def reference(self, times):
        now_ns = self.clock().now_ns()
        self.now().reference(now_ns + round(seconds * 1e9) for seconds in times)

    def sense(self, seconds):
        self.board.sense(seconds)

    def outputs(self):
        return self.now().outputs()

    def now(self):
        """Bring the board up to the present."""
        self.board.advance(self.clock().now_ns())
        return self.board
