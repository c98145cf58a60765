"""A board under test: the link's client, which asks anything and brings the board back to rest."""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

from rig.link import messages as wire
from rig.link.client import Device
from rig.link.exchange import Answer
from rig.link.frames import Frame, encode
from rig.link.messages import TEST_RUN, DisarmReason, Phase, RefusalReason, pack_label
from rig.link.port import Port, port_clock
from rig.link.transcript import Record
from rig.reasons import error_of, make_reason, rig_error
from rig.records import Edge
from rig.selftest.findings import NotPossibleError, fail_if, insist, need, wrong_answer

LABEL = pack_label(TEST_RUN, 1)
OTHER_LABEL = pack_label(TEST_RUN, 2)
PULSE_US = 50_000
_RECORD_MS = 60
_TRIES = 3
_ANSWER_S = 0.3
_RECORD_S = 2.0  # at most, from FIRE or ABORT to the certificate
_WATCH_S = 0.4
_LOOK_S = 0.0017  # in step with neither a USB frame nor the mains
_QUIET = (
    "a gate that is clear and steady; on a bare board a wire from one gate input to ground, and "
    "for the sync output a wire to another one (--loopback GATE)"
)

Check: TypeAlias = Callable[["BoardUnderTest"], str | None]
"""What a check finds, in words; or it raises why it ended."""
Request: TypeAlias = wire.HostMessage | tuple[int, bytes]
"""A message, or any code with any payload."""


class SelftestOptions(NamedTuple):
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


class GateStates(NamedTuple):
    """Masks of the gates that were blocked at every look, and at any look."""

    always: int
    sometimes: int


def name_gates(mask: int) -> str:
    """Name the gates of a mask, as in ``gates 1, 8``."""
    numbers = [str(n) for n in wire.channels_of(mask)]
    return f"gate{'s' * (len(numbers) > 1)} {', '.join(numbers)}"


class RecordedDrop(NamedTuple):
    """A drop as the board sent it of its own accord."""

    edges: tuple[Edge, ...]
    certificate: wire.DropCertificate2


class BoardUnderTest(Device):
    """One board during a self-test.

    No release is driven unless the options allow it: orders to arm pulse none, and where a check
    offers the board a bad order that would, the board is brought to rest before FIRE is ever sent.

    Parameters
    ----------
    port
        Open.
    options
        What may be done.

    Attributes
    ----------
    slowest_s
        Longest round trip of the pings; the slack that time limits get.
    """

    def __init__(self, port: Port, options: SelftestOptions) -> None:
        super().__init__(port, port_clock(port))
        self.options = options
        self.slowest_s = 0.0

    # -- asking

    def ask(self, request: Request, *, again: bool = False) -> wire.Message:
        """Send a request, a few times if need be, and give its answer.

        Parameters
        ----------
        request
            A message, or any code with any payload.
        again
            Whether it has the seq of the request before it, as a repeat has.

        Raises
        ------
        DeviceTimeoutError
            None came.
        NotPossibleError
            The emergency stop forbids it.
        """
        seq = self._seq = self._seq if again else self._seq % 254 + 1
        code, payload = request if isinstance(request, tuple) else wire.pack(request)
        for _ in range(_TRIES):
            self.write(encode(Frame(code, seq, 0, payload)))
            answer = self.wait_for(_ANSWER_S, lambda heard: heard.ack == seq)
            if answer is not None:
                need(answer != wire.Refused(RefusalReason.STOPPED, 0), "a closed emergency stop")
                return answer
        raise rig_error("device_silent", request=str(request))

    def receive(self) -> list[Record]:
        """Take what is there; a frame that is no message ends the check."""
        before, records = self.transcript.unreadable, super().receive()
        unreadable = self.transcript.unreadable > before
        fail_if(unreadable, "invalid_message", text=self.transcript.misreading)
        return records

    def expect(self, request: Request, kind: type[Answer], **fields: Any) -> Answer:
        """Ask, and insist on a kind of answer with these fields."""
        answer = self.ask(request)
        if isinstance(answer, kind) and answer == replace(answer, **fields):
            return answer
        values = ", ".join(f"{name}={value!r}" for name, value in fields.items())
        raise wrong_answer(str(request), f"{kind.__name__}({values})", answer)

    def refuse(self, request: Request, reason: RefusalReason, detail: int = 0) -> None:
        """Ask, and insist on being refused for a reason."""
        insist(str(request), self.ask(request), wire.Refused(reason, detail))

    def state(self, **fields: Any) -> wire.State:
        """Ask what the board is doing, and insist on some of it."""
        return self.expect(wire.Status(), wire.State, **fields)

    # -- rest, arming, and drops

    def foreign_drop(self) -> dict[str, int]:
        """Give run and attempt of a session's drop that the board has; empty without one."""
        drop = self.state().drop
        return {} if drop is None or drop.run == TEST_RUN else drop._asdict()

    def settle(self) -> None:
        """Bring the board to IDLE, and let it forget a drop of a self-test.

        Raises
        ------
        NotPossibleError
            It has a drop of somebody's session, which is left as it is.
        DeviceError
            It does not come to rest.
        """
        if drop := self.foreign_drop():
            raise error_of(NotPossibleError, make_reason("drop_held", **drop))
        self.abort()
        label = self.state().label
        if label and (held := self.collect(label, 0.0).certificate):
            self.acknowledge(label, held.crc32)
        self.state(phase=Phase.IDLE, label=0, events=0)

    def order(self, gates: int | None = None, **changes: int) -> wire.Arm:
        """Make an order of a quiet gate that drives nothing."""
        gates = self.quiet_gate() if gates is None else gates
        return replace(wire.Arm(LABEL, gates, 0, 0, 5000, _RECORD_MS), **changes)

    def prepare(self, **changes: int) -> int:
        """Arm a board at rest, whose releases have rested too; give the token."""
        self.settle()
        order = self.order(**changes)
        match self.ask(order):
            case wire.Armed(token):
                return token
            case wire.Refused(RefusalReason.COOLING, rest_ms):
                self.clock.sleep(1.02e-3 * rest_ms)
        return self.expect(order, wire.Armed).token

    def collect_drop(self) -> RecordedDrop:
        """Take a drop, and insist that the board sends all of it of its own accord."""
        assembly, requests = self.transcript.assembly(LABEL), self.requests
        edges = self.collect(LABEL, _RECORD_S).edges
        certificate, whole = assembly.certificate, assembly.sound() and self.requests == requests
        if not (whole and isinstance(certificate, wire.DropCertificate2)):
            raise wrong_answer("Fire", "all events and a certificate, unasked", "a part of them")
        return RecordedDrop(edges, certificate)

    def drop(self, **changes: int) -> RecordedDrop:
        """Arm, fire, and take the drop, which the board holds until it is brought to rest."""
        self.fire(self.prepare(**changes))
        return self.collect_drop()

    def wait_disarmed(self, event: str, reason: DisarmReason, seconds: float) -> int:
        """Insist on being disarmed for a reason after an event; give the host time, ns."""
        message = self.wait_for(seconds, lambda heard: isinstance(heard.message, wire.Disarmed))
        now_ns = self.clock.now_ns()
        insist(event, message or "no message", wire.Disarmed(LABEL, reason))
        self.state(phase=Phase.IDLE)
        return now_ns

    # -- gates

    @cached_property
    def gates(self) -> GateStates:
        """All gates, watched for a moment, once."""
        always = sometimes = self.state().gates
        end_ns = self.clock.now_ns() + round(_WATCH_S * 1e9)
        while self.clock.now_ns() < end_ns:
            blocked = self.state().gates
            always, sometimes = always & blocked, sometimes | blocked
            self.clock.sleep(_LOOK_S)
        return GateStates(always, sometimes)

    def quiet_gate(self) -> int:
        """Mask of one gate that is clear and steady, and not at the end of the loop-back wire.

        Raises
        ------
        NotPossibleError
            There is none.
        """
        restless = self.gates.sometimes
        if self.options.loopback is not None:
            restless |= 1 << self.options.loopback
        quiet = ~restless & ((1 << self.identity.gates) - 1)
        need(quiet, _QUIET)
        return 1 << quiet.bit_length() - 1

    @property
    def identity(self) -> wire.Identity:
        """Who the board is.

        Raises
        ------
        NotPossibleError
            It never said so.
        """
        if self.transcript.identity is None:
            raise error_of(NotPossibleError, make_reason("no_identity"))
        return self.transcript.identity
