"""Requests and their answers: repeats, time-outs, and the reading of the port."""

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TypeAlias, TypeVar

import serial

from rig.clock.host import Clock
from rig.link import messages as wire
from rig.link.frames import DELIMITER, Frame, encode
from rig.link.port import Port
from rig.link.refusals import DeviceRefusedError
from rig.link.transcript import Incoming, Record, Restart, Transcript
from rig.reasons import rig_error
from rig.records import Direction

Answer = TypeVar("Answer", bound=wire.DeviceMessage)
Halted: TypeAlias = Callable[[], bool]
"""Asked all the time whether what is under way shall end."""

_WAIT_S = 0.1  # for the first answer
_LONGEST_WAIT_S = 0.5
_BACK_OFF = 1.5
_PAST_SEQ = 255
"""Of what goes past a request that is under way, whose answer it must not be taken for."""
# The delimiter ends what another thread may be in the middle of: that is sent again.
_ABORT = DELIMITER + encode(Frame(wire.CODES[wire.Abort], _PAST_SEQ, 0, b""))
STRANGE_BYTES = 1 << 20
"""Read and kept at most of somebody who has not said who he is."""
_AT_ONCE = 1 << 16
_NOISE = 4096  # bytes without a delimiter that are no half of a frame any more


@contextmanager
def _line() -> Iterator[None]:
    """Say of a port that fails that the connection is lost."""
    try:
        yield
    except OSError as error:  # SerialException is one
        # Of a serial port that is gone the cause is pyserial's own, and not the system's.
        is_gone = isinstance(error.__context__, serial.SerialException)
        text = "the port is gone" if is_gone else str(error)
        raise rig_error("connection_lost", text=text) from error


@dataclass(eq=False, repr=False)
class Exchange:
    """One port, and the conversation over it.

    Parameters
    ----------
    port, clock
        The port and its time.
    tap
        Called with every byte written or read, before anything else is done with it; what was
        read is kept together until a frame has ended or something is written.
    on_record
        Called with everything that becomes known.
    tries
        How often a request is sent before the device counts as silent.
    give_way
        Called all the time while an answer is waited for; what it raises ends the waiting.

    Attributes
    ----------
    transcript
        The machine all bytes go through.
    expect_boot
        While true, a restart of the board is not an error.
    requests, repeats
        How many were sent, and how often one was sent again.
    rx_bytes, tx_bytes
        How much went over the line.
    """

    port: Port
    clock: Clock
    tap: Callable[[Direction, int, bytes], object] = lambda *_: None
    on_record: Callable[[Record], object] = lambda _: None
    tries: int = 8
    give_way: Callable[[], object] = lambda: None
    transcript: Transcript = field(default_factory=Transcript)
    expect_boot: bool = False
    requests: int = 0
    repeats: int = 0
    rx_bytes: int = 0
    tx_bytes: int = 0
    _seq: int = 0
    _part: bytes = b""  # of a frame that has not ended yet
    _past: deque[tuple[int, bytes]] = field(default_factory=deque)  # what `abort_past` sent

    def request(
        self, message: wire.HostMessage, kind: type[Answer], tries: int = 0, wait: float = _WAIT_S
    ) -> Answer:
        """Send a request until it is answered; every repeat has the same seq.

        Parameters
        ----------
        message
            The request.
        kind
            Which message answers it.
        tries
            How often to send it; 0 for as often as usual.
        wait
            How long to wait for the first answer, s; longer from try to try.

        Returns
        -------
        DeviceMessage
            The answer.

        Raises
        ------
        DeviceRefusedError
            The device refused.
        DeviceTimeoutError
            It did not answer any of the tries.
        DeviceError
            It answered something else, restarted, or the connection broke.
        """
        seq = self._seq = self._seq % (_PAST_SEQ - 1) + 1
        code, payload = wire.pack(message)
        data = encode(Frame(code, seq, 0, payload))
        self.requests += 1
        for number in range(tries or self.tries):
            self.repeats += number > 0
            self.write(data)
            answer = self.wait_for(wait, lambda got: got.ack == seq)
            wait = min(wait * _BACK_OFF, _LONGEST_WAIT_S)
            if isinstance(answer, kind):
                return answer
            if isinstance(answer, wire.Refused):
                raise DeviceRefusedError(answer.reason, answer.detail, self.transcript.disarmed)
            if answer is not None:
                names = {"request": type(message).__name__, "answer": type(answer).__name__}
                raise rig_error("device_confused", **names)
        raise rig_error("device_silent", request=type(message).__name__)

    def wait_for(self, seconds: float, wanted: Callable[[Incoming], bool]) -> wire.Message | None:
        """Read until a message comes that is waited for, or the time is over.

        Parameters
        ----------
        seconds
            How long.
        wanted
            Whether it is the one.

        Returns
        -------
        Message or None
            The first of them.
        """
        until = self.clock.now_ns() + round(seconds * 1e9)
        while self.clock.now_ns() < until:
            self.give_way()
            for record in self.receive():
                if isinstance(record, Incoming) and wanted(record):
                    return record.message
        return None

    def receive(self) -> list[Record]:
        """Take what is there, waiting no longer than the port's time-out.

        Returns
        -------
        list of Record
            What became known.

        Raises
        ------
        DeviceError
            The board restarted, or the connection broke.
        """
        with _line():
            data = self.port.read(min(max(1, self.port.in_waiting), _AT_ONCE))
        self.rx_bytes += len(data)
        if self.rx_bytes > STRANGE_BYTES and self.transcript.identity is None:
            good = self.transcript.rx.good
            lacking = "and no word of who is there" if good else "that are no frames"
            raise rig_error("bytes_strange", size_mb=self.rx_bytes / 1e6, lacking=lacking)
        self._part += data
        # A line gives single bytes, and half a frame says nothing.
        ended = DELIMITER in data or len(self._part) > _NOISE
        records = self._log_part() if ended else []
        restarts = (record for record in records if isinstance(record, Restart))
        if not self.expect_boot and (restart := next(restarts, None)):
            if restart.label is None:
                raise rig_error("board_restarted")
            raise rig_error("board_restarted_in_drop", moment=restart.when)
        return records

    def write(self, data: bytes) -> None:
        """Send bytes.

        Parameters
        ----------
        data
            The bytes.

        Raises
        ------
        DeviceError
            The connection broke.
        """
        self._log_part()
        self.tx_bytes += len(data)
        self._log("tx", data)
        with _line():
            self.port.write(data)

    @_line()
    def set_rate(self, baudrate: int) -> None:
        """Change the line's rate, bit/s.

        Raises
        ------
        DeviceError
            The connection broke.
        """
        self.port.baudrate = baudrate

    def abort_past(self) -> None:
        """Send ABORT at once, from any thread, past a request that is under way.

        Nobody waits for its answer. The tap is given it before whatever comes next.

        Raises
        ------
        OSError
            The connection broke.
        """
        self._past.append((self.clock.now_ns(), _ABORT))
        self.port.write(_ABORT)

    @_line()
    def waiting(self) -> int:
        """Count the bytes that have arrived and were not read yet.

        Raises
        ------
        DeviceError
            The connection broke.
        """
        return self.port.in_waiting

    def _log_part(self) -> list[Record]:
        part, self._part = self._part, b""
        return self._log("rx", part) if part else []

    def log_past(self) -> None:
        """Give the tap what other threads have sent, before anything else or at the end."""
        while self._past:
            self._feed("tx", *self._past.popleft())

    def _log(self, direction: Direction, data: bytes) -> list[Record]:
        self.log_past()
        return self._feed(direction, self.clock.now_ns(), data)

    def _feed(self, direction: Direction, now_ns: int, data: bytes) -> list[Record]:
        self.tap(direction, now_ns, data)
        records = self.transcript.feed(direction, now_ns, data)
        for record in records:
            self.on_record(record)
        return records
