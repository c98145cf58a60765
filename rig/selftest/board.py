"""A board under test: asking it, waiting for it, and bringing it back to rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from rig.link import messages as wire
from rig.link.exchange import Answer, Exchange
from rig.link.frames import DELIMITER, Frame, encode
from rig.link.gatewatch import GateStates, watch_gates
from rig.link.messages import TEST_RUN, DisarmReason, Phase, RefusalReason, pack_label, unpack_label
from rig.link.refusals import DeviceRefusedError
from rig.link.transcript import Incoming
from rig.selftest.findings import (
    CheckFailedError,
    NotPossibleError,
    fail_if,
    insist,
    need,
    wrong_answer,
)

if TYPE_CHECKING:
    from rig.clock.host import Clock
    from rig.link.port import Port

Check: TypeAlias = Callable[["BoardUnderTest"], str | None]
"""What a check finds, in words; or it raises why it ended."""
LABEL = pack_label(TEST_RUN, 1)
OTHER_LABEL = pack_label(TEST_RUN, 2)
RECORD_MS = 60
PULSE_US = 50_000
_OF_DROPS = (wire.Fire, wire.Abort, wire.Read, wire.Acknowledge)
_TRIES = 3
_ANSWER_S = 0.3
_END_S = 1.0  # at most, from the end of a recording to its certificate
_WATCH_S = 0.4
_REST_MS = 5000  # above what any release needs after the longest pulse
_QUIET = (
    "a gate that is clear and steady; on a bare board a wire from one gate input to ground, and "
    "for the sync output a wire to another one (--loopback GATE)"
)


class RawRequest(NamedTuple):
    """Any frame, sent as a request."""

    code: int
    payload: bytes = b""


Request: TypeAlias = wire.HostMessage | RawRequest


@dataclass(frozen=True, slots=True)
class SelftestOptions:
    """What the user allows and has wired.

    Attributes
    ----------
    loopback
        The gate that a wire joins to the sync output, or `None`.
    drops
        How often to fire for the loop-back's statistics.
    release
        Whether release 0 may be driven.
    gates
        Mask of the gates in use; `None`: whichever are clear.
    """

    loopback: int | None = None
    drops: int = 20
    release: bool = False
    gates: int | None = None


def name_request(request: Request) -> str:
    """Name a request for a message."""
    if not isinstance(request, RawRequest):
        return type(request).__name__
    kind = wire.TABLE.get(request.code)
    if kind is None or request.code >= 0x80:
        return f"type 0x{request.code:02X}"
    return f"{kind.__name__} of {len(request.payload)} bytes"


@dataclass(frozen=True, slots=True)
class RecordedDrop:
    """A drop as the board sent it of its own accord."""

    events: tuple[wire.Event, ...]
    certificate: wire.DropCertificate2


class BoardUnderTest(Exchange):
    """One board during a self-test.

    No release is driven unless the options allow it: orders to arm pulse none, and where a check
    offers the board a bad order that would, FIRE stays unsaid until the board is disarmed again.

    Parameters
    ----------
    port, clock
        The open port and its time.
    options
        What may be done.

    Attributes
    ----------
    foreign
        Label of a drop of somebody's session that the board holds, or 0.
    slowest_s
        Longest round trip of the pings; the slack that time limits get.
    """

    def __init__(self, port: Port, clock: Clock, options: SelftestOptions) -> None:
        super().__init__(port, clock)
        self.expect_boot = True  # to be restarted ends no check by itself
        self.options = options
        self.foreign = 0
        self.slowest_s = 0.0
        self._heard: list[Incoming] = []  # and taken by nobody yet
        self._may_release = False

    # -- asking

    def next_seq(self) -> int:
        """Give a seq that the request before did not have."""
        self._seq = self._seq % 255 + 1
        return self._seq

    def send(self, request: Request, seq: int) -> None:
        """Send a request once, be it a message or not."""
        code, payload = request if isinstance(request, RawRequest) else wire.pack(request)
        self.write(encode(Frame(code, seq, 0, payload)))

    def ask(self, request: Request, seq: int = 0) -> wire.Message:
        """Send a request, a few times if need be, and give its answer.

        Raises
        ------
        CheckFailedError
            None came.
        NotPossibleError
            It is about drops, of which the board holds somebody's.
        """
        if isinstance(request, _OF_DROPS):
            self.need_idle()
        if isinstance(request, wire.Arm) and request.release and not self.options.release:
            self._may_release = True
        fail_if(isinstance(request, wire.Fire) and self._may_release, "fire_withheld")
        seq = seq or self.next_seq()
        for _ in range(_TRIES):
            self.send(request, seq)
            heard = self.wait(_ANSWER_S, lambda heard: heard.ack == seq)
            if heard is not None:
                return heard.message
        raise CheckFailedError("no_answer", request=name_request(request))

    def answer(self, message: wire.HostMessage, kind: type[Answer]) -> Answer:
        """Ask, and insist on one kind of answer."""
        answer = self.ask(message)
        if not isinstance(answer, kind):
            raise wrong_answer(name_request(message), kind.__name__, answer)
        return answer

    def refuse(
        self,
        request: Request,
        reason: RefusalReason,
        detail: int | None = None,
        name: str = "",
    ) -> wire.Refused:
        """Ask, and insist on being refused, for a reason and with a detail where one is given."""
        answer, name = self.ask(request), name or name_request(request)
        if not isinstance(answer, wire.Refused):
            raise wrong_answer(name, f"Refused({reason.name})", answer)
        insist(name, answer, wire.Refused(reason, answer.detail if detail is None else detail))
        return answer

    def wait(self, seconds: float, accepts: Callable[[Incoming], bool]) -> Incoming | None:
        """Wait for a message, at most so long; what else comes unasked is kept."""
        end_ns = self.clock.now_ns() + round(seconds * 1e9)
        while True:
            for n, heard in enumerate(self._heard):
                if accepts(heard):
                    return self._heard.pop(n)
            self._heard = [heard for heard in self._heard if heard.ack == 0]
            if self.clock.now_ns() >= end_ns:
                return None
            before, records = self.transcript.unreadable, self.receive()
            self._heard += [record for record in records if isinstance(record, Incoming)]
            unreadable = self.transcript.unreadable > before
            fail_if(unreadable, "invalid_message", text=self.transcript.misreading)

    def wait_unasked(self, seconds: float, *kinds: type[wire.DeviceMessage]) -> Incoming | None:
        """Give the next message of some kinds that came, or comes in time, of its own accord."""
        return self.wait(seconds, lambda h: h.ack == 0 and isinstance(h.message, kinds))

    # -- arming and drops

    def order(self, **changes: int) -> wire.Arm:
        """Make an order of a quiet gate that drives nothing, of a board that is idle."""
        self.need_idle()
        if "gates" not in changes:
            changes["gates"] = self.quiet_gate()
        return replace(wire.Arm(LABEL, 0, 0, 0, 5000, RECORD_MS), **changes)

    def arm(self, **changes: int) -> int:
        """Arm, after a release that the order pulses has rested; give the token."""
        order = self.order(**changes)
        answer = self.ask(order)
        match answer:
            case wire.Refused(RefusalReason.COOLING, ms) if order.release and ms < _REST_MS:
                self.clock.sleep(1.02e-3 * ms)
                answer = self.ask(order)
        return self.read_token(answer)

    def read_token(self, answer: wire.Message) -> int:
        """Take the token from an answer to ARM.

        Raises
        ------
        NotPossibleError
            Something that only hands can change forbids arming.
        """
        match answer:
            case wire.Armed(token=token):
                return token
            case wire.Refused(RefusalReason.STOPPED | RefusalReason.COOLING, detail):
                (reason,) = DeviceRefusedError(answer.reason, detail).reasons
                raise NotPossibleError(reason.code, **reason.values)
        raise wrong_answer("Arm", "Armed", answer)

    def fire(self, token: int) -> wire.Fired:
        """Fire what was armed."""
        return self.answer(wire.Fire(token), wire.Fired)

    def drop(self, **changes: int) -> RecordedDrop:
        """Arm, fire, and take what the board sends until its certificate."""
        self.fire(self.arm(**changes))
        return self.collect_drop()

    def collect_drop(self, record_ms: int = RECORD_MS) -> RecordedDrop:
        """Take what the board sends of a drop, up to its certificate."""
        events: list[wire.Event] = []
        deadline = self.clock.now_ns() + round((record_ms / 1000 + _END_S) * 1e9)
        while (left_ns := deadline - self.clock.now_ns()) > 0:
            heard = self.wait_unasked(left_ns * 1e-9, wire.EventsFrame, wire.DropCertificate)
            match heard and heard.message:
                case wire.EventsFrame(snapshots=snapshots):
                    events += snapshots
                case wire.DropCertificate2() as certificate:
                    return RecordedDrop(tuple(events), certificate)
                case wire.DropCertificate() as certificate:
                    raise wrong_answer("a drop", "DropCertificate2", certificate)
        raise CheckFailedError("no_certificate")

    def acknowledge(self, recorded: RecordedDrop) -> RecordedDrop:
        """Let the board forget a drop, and give it."""
        certificate = recorded.certificate
        self.answer(wire.Acknowledge(certificate.label, certificate.crc32), wire.Done)
        return recorded

    # -- rest

    def state(self) -> wire.State:
        """Ask what the board is doing."""
        return self.answer(wire.Status(), wire.State)

    def insist_state(self, event: str, **fields: Any) -> None:
        """Insist on some of what the board says of its state after an event."""
        state = self.state()
        insist(f"Status after {event}", state, replace(state, **fields))

    def wait_disarmed(self, event: str, reason: DisarmReason, seconds: float) -> int:
        """Insist on being disarmed for a reason after an event; give the host time, ns."""
        heard = self.wait_unasked(seconds, wire.Disarmed)
        message = heard.message if heard else "no message"
        insist(event, message, wire.Disarmed(LABEL, reason))
        self.insist_state("Disarmed", phase=Phase.IDLE)
        return heard.host_ns if heard else 0

    def abort(self) -> None:
        """Disarm the board, or end its recording."""
        self.answer(wire.Abort(), wire.Done)

    def settle(self) -> None:
        """Bring the board back to IDLE; somebody else's drop is left as it is.

        Raises
        ------
        CheckFailedError
            It does not come to rest.
        NotPossibleError
            It is not known who it is.
        """
        if self.transcript.identity is None:
            raise NotPossibleError("no_identity")
        self.write(DELIMITER)
        self._heard.clear()
        for _ in range(4):
            state = self.state()
            own = unpack_label(state.label)[0] == TEST_RUN
            if state.phase is Phase.IDLE:
                self._may_release = False
                return
            if state.phase is not Phase.ARMED and not own:
                self.foreign = state.label
                return
            if state.phase is Phase.HOLDING:
                held = self.answer(wire.Read(state.label, 0, 0), wire.DropCertificate)
                self.ask(wire.Acknowledge(held.label, held.crc32))
            else:
                self.abort()
                self.wait(_ANSWER_S, lambda h: isinstance(h.message, wire.DropCertificate))
        raise wrong_answer("Abort", "an idle board", state.phase.name)

    def need_idle(self) -> None:
        """Refuse to go on before a board that holds somebody's drop.

        Raises
        ------
        NotPossibleError
            It does.
        """
        if self.foreign:
            run, attempt = unpack_label(self.foreign)
            raise NotPossibleError("drop_held", run=run, attempt=attempt)

    # -- gates

    @cached_property
    def gates(self) -> GateStates:
        """All gates, watched for a moment, once."""
        return watch_gates(lambda: self.state().gates, self.clock, _WATCH_S)

    def quiet_gate(self) -> int:
        """Mask of one gate that is clear and steady, and not at the end of the loop-back wire.

        Raises
        ------
        NotPossibleError
            There is none.
        """
        states = self.gates
        restless = states.stuck | states.flickering
        if self.options.loopback is not None:
            restless |= 1 << self.options.loopback
        quiet = ~restless & ((1 << self.identity.gates) - 1)
        need(quiet, _QUIET)
        return 1 << quiet.bit_length() - 1

    @property
    def identity(self) -> wire.Identity:
        """Who the board is."""
        assert self.transcript.identity is not None, "the handshake comes first"
        return self.transcript.identity
