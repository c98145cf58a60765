"""A pyserial port in virtual time, with a virtual board at its other end."""

from __future__ import annotations

import random
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from serial import PortNotOpenError, SerialBase, SerialException

from .clock import VirtualClock
from .dials import Dials
from .line import LineFaults

if TYPE_CHECKING:
    from .interfaces import Board

_CALL_NS = 1_000  # a call takes time too: without this, polling would stop the clock


class SimulatedSerial(SerialBase):
    """A port without threads: waiting lets virtual time pass, and the board with it.

    For a URL handler: derive, and override `make_board`.

    Parameters
    ----------
    port
        Name or URL; opens at once when given (pyserial's habit).
    board
        What is connected; otherwise `make_board` is asked when the port is opened.
    clock
        Virtual time; a new one by default.
    jitter_s
        Mean of the exponential delay with which the host sees a byte.
    reset_on_open
        Whether opening restarts the board, as DTR does to a Mega.
    **settings
        Settings of `serial.SerialBase`.
    """

    def __init__(
        self,
        port: str | None = None,
        *,
        board: Board | None = None,
        clock: VirtualClock | None = None,
        jitter_s: float = 0.3e-3,
        reset_on_open: bool = True,
        **settings: Any,
    ) -> None:
        self.clock = VirtualClock() if clock is None else clock
        self.board = board
        self.reset_on_open = reset_on_open
        self.disturb(0, replace(Dials.quiet(), latency=jitter_s))
        self._buffer = bytearray()
        self._line_free_ns = 0
        super().__init__(port, **settings)

    def disturb(self, seed: int, dials: Dials) -> None:
        """Choose the line's latency, stalls and faults; same seed, same bytes."""
        self._random = random.Random(f"latency {seed}")
        self._dials = dials
        self._to_board = LineFaults(dials.corrupt, dials.lose, seed=2 * seed)
        self._to_host = LineFaults(dials.corrupt, dials.lose, seed=2 * seed + 1)

    def make_board(self) -> Board:
        """Build the board that `self.port` names; may call `disturb` too."""
        raise SerialException("no virtual board behind this port")

    def open(self) -> None:
        """Open the port (and restart the board)."""
        if self.is_open:
            raise SerialException("port is already open")
        if self.board is None:
            self.board = self.make_board()
        self._buffer.clear()
        self.is_open = True
        if self.reset_on_open:
            self.board.reset(self.clock.now_ns())

    def close(self) -> None:
        """Close the port; the board stays as it is."""
        self.is_open = False

    @property
    def in_waiting(self) -> int:
        """Bytes that can be read at once."""
        self._pass(_CALL_NS)
        return len(self._buffer)

    def read(self, size: int = 1, /) -> bytes:
        """Read bytes.

        Parameters
        ----------
        size
            How many.

        Returns
        -------
        bytes
            Fewer when the time-out is over.
        """
        board = self._pass(_CALL_NS)
        clock, dials = self.clock, self._dials
        end_ns = None if self.timeout is None else clock.now_ns() + round(self.timeout * 1e9)
        while len(self._buffer) < size:
            next_ns, arrives = self.upcoming(board, end_ns)
            if next_ns is None and end_ns is None:
                raise SerialException("waiting without a time-out for a board that is silent")
            if end_ns is not None and (next_ns is None or next_ns > end_ns):
                clock.advance_to(end_ns)
                self._pass(0)
                break
            clock.advance_to(next_ns or 0)
            if arrives and dials.latency > 0:
                clock.sleep(self._random.expovariate(1 / dials.latency))
            if arrives and dials.stalled > 0 and self._random.random() < dials.stalled:
                clock.sleep(dials.stall)
            self._pass(0)
        data = bytes(self._buffer[:size])
        del self._buffer[:size]
        return data

    def upcoming(self, board: Board, end_ns: int | None) -> tuple[int | None, bool]:
        """Find out how far a read may jump.

        Parameters
        ----------
        board
            The one that is connected.
        end_ns
            When the read gives up; the host sends nothing before. `None`: never.

        Returns
        -------
        int or None, bool
            When the board will do something (`None`: never), and whether a byte arrives then.
        """
        del end_ns  # for boards that can run ahead
        arrival_ns = board.line.next_arrival_ns()
        return (board.next_ns(), False) if arrival_ns is None else (arrival_ns, True)

    def write(self, data: Any, /) -> int:
        """Send bytes; they leave at line rate, and this returns at once."""
        board = self._pass(_CALL_NS)
        sent = bytes(data)
        start_ns = max(self.clock.now_ns(), self._line_free_ns)
        self._line_free_ns = start_ns + len(sent) * board.line.byte_ns
        board.receive(start_ns, self._to_board.damage(sent))
        return len(sent)

    def flush(self) -> None:
        """Wait until everything is sent."""
        self.clock.advance_to(self._line_free_ns)

    def reset_input_buffer(self) -> None:
        """Forget what was received and not read."""
        self._pass(0)
        self._buffer.clear()

    def reset_output_buffer(self) -> None:
        """Do nothing: what was written is on its way."""

    def _pass(self, ns: int) -> Board:
        """Let time pass and collect what arrived."""
        if not self.is_open or self.board is None:
            raise PortNotOpenError
        if ns:
            self.clock.advance_to(self.clock.now_ns() + ns)
        now_ns = self.clock.now_ns()
        self.board.advance(now_ns)
        self._buffer += self._to_host.damage(self.board.line.read(now_ns))
        return self.board

    def _reconfigure_port(self) -> None:
        """Accept any settings: pyserial calls this when one changes on an open port."""
