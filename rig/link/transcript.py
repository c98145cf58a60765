"""Bytes in both directions → clock samples, drops, messages; without any I/O.

The live client and the replay of a session feed the same bytes through this one machine, so they
get the same drops by construction. How the bytes were cut into chunks matters only for the host
times of clock samples and for the lone delimiter with which a client begins a connection.
"""

from typing import NamedTuple, TypeAlias

from rig.link import messages as wire
from rig.link.assembly import Assembly
from rig.link.frames import DELIMITER, Decoder, Frame
from rig.records import ClockSample, Direction, Drop, Pulse

_CAUSES = {1: "power", 2: "reset pin", 4: "brown-out", 8: "watchdog"}


class Incoming(NamedTuple):
    """One message from the device; `ack` is the request's seq, 0 when it answers none."""

    host_ns: int
    ack: int
    message: wire.Message


class Restart(NamedTuple):
    """A restart of the board that the opening of the port does not explain.

    Attributes
    ----------
    host_ns
        When the board was back.
    cause
        As BOOT has it.
    label
        Of the drop that was recorded; `None` when nothing fell.
    back_s
        How long after FIRE it was back, s; 0 when nothing fell.
    start_up_s
        From a reset to BOOT, boot loader and all, as seen when the port was opened, s; `None` when
        that was not seen.
    """

    host_ns: int
    cause: int
    label: int | None = None
    back_s: float = 0.0
    start_up_s: float | None = None

    @property
    def when(self) -> str:
        """When it was, by what is known of the drop and of the board's boot loader."""
        if self.label is None:
            return "while nothing fell"
        if self.start_up_s is None or self.back_s < self.start_up_s:
            return f"within {self.back_s * 1e3:.0f} ms of FIRE"
        return f"about {(self.back_s - self.start_up_s) * 1e3:.0f} ms after FIRE"


def causes(mask: int) -> str:
    """Name the causes in a mask as BOOT has it, to go behind a moment; empty if none is known.

    A boot loader may have cleared it.
    """
    words = ", ".join(word for bit, word in _CAUSES.items() if mask & bit)
    return f" ({words})" if words else ""


Record: TypeAlias = Incoming | ClockSample | Pulse | Drop | Restart


class Transcript:
    """Reads a conversation.

    A drop is given out when the host's ACKNOWLEDGE for it goes over the wire: the one moment
    that shows in the bytes alone that the host has read enough. A drop that was never
    acknowledged is in `unfinished_drops`.

    Attributes
    ----------
    identity
        The device's last IDENTITY, or `None`.
    rx
        What is read of the device's bytes, and how much of it was good.
    unreadable
        Frames with a good CRC whose payload was no message.
    misreading
        Why the last of them was none.
    sample
        The latest clock sample, or `None`.
    disarmed
        Why the device disarmed itself since it was armed, or `None`.
    """

    def __init__(self) -> None:
        self.identity: wire.Identity | None = None
        self.sample: ClockSample | None = None
        self.disarmed: wire.DisarmReason | None = None
        self.unreadable = 0
        self.misreading = ""
        self._tx = Decoder()
        self.rx = Decoder()
        self._request: tuple[int, wire.Message] = (0, wire.Status())
        self._answered = False
        self._asked_ns: dict[int, int] = {}  # of the open sample, by its seq
        self._tokens: dict[int, int] = {}
        self._drops: dict[int, Assembly] = {}
        self._given: set[int] = set()
        self._opened_ns: int | None = None  # until it has booted, or said who it is
        self._start_up_s: float | None = None
        self._fired: tuple[int, int] | None = None  # label and host time, until the certificate

    def feed(self, direction: Direction, host_ns: int, data: bytes) -> list[Record]:
        """Take the next bytes of one direction.

        Parameters
        ----------
        direction
            Who sent them.
        host_ns
            Host time of the chunk.
        data
            The bytes, cut anywhere.

        Returns
        -------
        list of Record
            What became known by them, in order.
        """
        if direction == "tx" and data == DELIMITER:
            # A client begins a connection with this. Half a frame from the connection before
            # must not swallow the first of this one: live, each connection starts afresh.
            self.rx.feed(DELIMITER)
            self._asked_ns, self._fired = {}, None
            self._opened_ns = host_ns
        decoder, take = (self._tx, self._sent) if direction == "tx" else (self.rx, self._got)
        records: list[Record] = []
        for frame in decoder.feed(data):
            try:
                message = wire.unpack(frame.type, frame.payload)
            except wire.MessageError as error:
                self.unreadable += 1
                self.misreading = str(error)
            else:
                records += take(host_ns, frame, message)
        return records

    def pending(self, label: int) -> Drop:
        """Give a drop as far as it is known; what ACKNOWLEDGE would give out now.

        Parameters
        ----------
        label
            The drop's label.

        Returns
        -------
        Drop
            With faults for what is missing.

        Raises
        ------
        KeyError
            When nothing of such a drop was seen, or it was given out already.
        """
        return self._drops[label].drop(self._tick_hz)

    def assembly(self, label: int) -> Assembly:
        """Give the open drop of a label, begun anew when there is none.

        Parameters
        ----------
        label
            The drop's label.

        Returns
        -------
        Assembly
            To ask what is missing, or to have it read again.
        """
        self._given.discard(label)
        return self._drops.setdefault(label, Assembly(label))

    def unfinished_drops(self) -> list[Drop]:
        """Give the drops that began and were never acknowledged.

        Returns
        -------
        list of Drop
            In the order in which they were armed.
        """
        return [drop.drop(self._tick_hz) for drop in self._drops.values() if drop.begun]

    @property
    def _tick_hz(self) -> int:
        return self.identity.tick_hz if self.identity else 0

    def _sent(self, host_ns: int, frame: Frame, message: wire.Message) -> list[Record]:
        if isinstance(message, wire.Abort):
            return []  # it may go past a request whose answer is still to come
        repeated = self._request == (frame.seq, message)
        self._request = (frame.seq, message)
        self._answered = repeated and self._answered
        match message:
            case wire.Ping() | wire.Reference():
                # It cannot be told which of two equal requests an answer belongs to.
                self._asked_ns = {} if repeated else {frame.seq: host_ns}
            case wire.Read(label=label) if not repeated:
                self.assembly(label)  # asking for it means wanting it, even once given out
            case wire.Acknowledge(label=label) if label in self._drops:
                drop = self._drops.pop(label)
                self._given.add(label)
                return [drop.drop(self._tick_hz)] if drop.begun else []
        return []

    def _got(self, host_ns: int, frame: Frame, message: wire.Message) -> list[Record]:
        records: list[Record] = [Incoming(host_ns, frame.ack, message)]
        seq, request = self._request
        # Only the first answer counts: a repeated ARMED must not begin the drop a second time.
        asked = request if seq and frame.ack == seq and not self._answered else None
        self._answered = self._answered or asked is not None
        match message:  # the most frequent first
            case wire.EventsFrame() if message.label not in self._given:
                self.assembly(message.label).add(message)
            case wire.Pong(tick) if frame.ack in self._asked_ns:
                self.sample = ClockSample(self._asked_ns.pop(frame.ack), host_ns, tick)
                records.append(self.sample)
            case wire.Identity():
                self.identity = message
                self._opened_ns = None
            case wire.ReferencePulse(count, tick) if count and frame.ack in self._asked_ns:
                records.append(Pulse(self._asked_ns.pop(frame.ack), host_ns, count, tick))
            case wire.Armed(token):
                self.disarmed = None
                if isinstance(asked, wire.Arm):
                    self._tokens = {token: asked.label}
                    self._given.discard(asked.label)
                    self._drops[asked.label] = Assembly(asked.label, asked.gates, asked.record_ms)
            case wire.Disarmed(_, reason):
                self.disarmed = reason
            case wire.Fired(tick=tick) if isinstance(asked, wire.Fire):
                label = self._tokens.get(asked.token)
                if label in self._drops:
                    self._drops[label].fire_tick = tick
                    self._fired = label, host_ns
            case wire.Refused(wire.RefusalReason.NOT_KEPT, first) if isinstance(asked, wire.Read):
                self.assembly(asked.label).first_kept = first
            case wire.DropCertificate(label=label) if label not in self._given:
                self.assembly(label).certificate = message
                self._fired = None
            case wire.Boot(cause):
                records += self._take_boot(host_ns, cause)
        return records

    def _take_boot(self, host_ns: int, cause: int) -> list[Restart]:
        self._asked_ns = {}
        for drop in self._drops.values():
            drop.reset = True
        opened_ns, fired = self._opened_ns, self._fired
        self._opened_ns = self._fired = None
        if opened_ns is not None:
            self._start_up_s = (host_ns - opened_ns) * 1e-9
            return []
        label, fired_ns = fired or (None, host_ns)
        return [Restart(host_ns, cause, label, (host_ns - fired_ns) * 1e-9, self._start_up_s)]
