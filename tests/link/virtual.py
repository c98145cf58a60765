"""The bench of a board in virtual time, behind a simulated port."""

from sim.serial_port import SimulatedSerial
from tests.link.bench import Bench, ScriptedLab


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
