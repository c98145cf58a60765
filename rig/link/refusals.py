"""What a refusal means, and what the user can do about it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.boards import GATES
from rig.errors import DeviceError
from rig.link.messages import PROTOCOL_VERSION, DisarmReason, RefusalReason

if TYPE_CHECKING:
    from rig.link.messages import Refused

ADVICE: dict[RefusalReason, tuple[str, str]] = {
    RefusalReason.NOT_ARMED: (
        "the device is not armed",
        "it disarms itself when it has waited too long: arm again",
    ),
    RefusalReason.WRONG_TOKEN: (
        "the device was armed by somebody else",
        "make sure that only one program controls the device, then arm again",
    ),
    RefusalReason.GATE_BLOCKED: (
        "{gates} blocked",
        "clear the beam, and check that its emitter has power",
    ),
    RefusalReason.GATE_UNSTEADY: (
        "{gates} changed after arming",
        "let everything come to rest, check for loose plugs and stray light, then arm again",
    ),
    RefusalReason.BAD_PARAMETER: (
        "the device cannot do what was asked",
        "compare gates, release and pulse of the protocol file with what the board has",
    ),
    RefusalReason.BUSY: ("the device is recording", "wait until the drop is over, or abort it"),
    RefusalReason.HOLDING_A_DROP: (
        "the device still holds the drop of run {detail}",
        "read and acknowledge that drop first: resume its session",
    ),
    RefusalReason.NO_SUCH_DROP: (
        "the device does not hold this drop",
        "it was acknowledged before, or lost when the board restarted: repeat the run",
    ),
    RefusalReason.WRONG_CRC: (
        "the device holds different data than was acknowledged",
        "read the drop again",
    ),
    RefusalReason.VERSION: (
        "the board's firmware speaks protocol version {detail}, this program version "
        f"{PROTOCOL_VERSION}",
        "bring both to the same version: rig flash",
    ),
    RefusalReason.STOPPED: (
        "the emergency stop is open",
        "see that nobody is in danger and close it, then arm again",
    ),
    RefusalReason.COOLING: (
        "the release must rest for {detail} ms more",
        "wait that long, then arm again: its coil may be on for a quarter of the time",
    ),
    RefusalReason.NOT_KEPT: (
        "the device keeps events from number {detail} on only",
        "repeat the run; a board with more memory keeps a drop whole",
    ),
    RefusalReason.UNKNOWN_MESSAGE: (
        "the device does not know this request",
        "its firmware is older than this program: rig flash",
    ),
}

DISARMED: dict[DisarmReason, tuple[str, str]] = {
    DisarmReason.TIMEOUT: (
        "the device disarmed itself: it waited too long to be fired",
        "arm again",
    ),
    DisarmReason.HOST_SILENT: (
        "the device disarmed itself: this program was silent for too long",
        "a busy computer, a slow disk or a bad cable does that; arm again",
    ),
    DisarmReason.STOPPED: (
        "the device disarmed itself: the emergency stop was opened",
        ADVICE[RefusalReason.STOPPED][1],
    ),
}


class DeviceRefusedError(DeviceError):
    """The device understood the request and refused it.

    Attributes
    ----------
    reason
        The device's reason.
    detail
        What the reason's definition says it is.
    disarmed
        Why the device had disarmed itself before, where that is the cause.
    """

    def __init__(
        self, reason: RefusalReason, detail: int, disarmed: DisarmReason | None = None
    ) -> None:
        message, hint = ADVICE[reason] if disarmed is None else DISARMED[disarmed]
        gates = [str(n) for n in range(GATES) if detail >> n & 1]
        named = f"gate {gates[0]} is" if len(gates) == 1 else f"gates {', '.join(gates)} are"
        if not gates:  # a flicker so short that the device cannot say whose
            named = "a gate is"
        if reason is RefusalReason.GATE_UNSTEADY:
            named = named.rsplit(" ", 1)[0]
        super().__init__(message.format(gates=named, detail=detail), hint)
        self.reason = reason
        self.detail = detail
        self.disarmed = disarmed


def refusal(answer: Refused) -> DeviceRefusedError:
    """Make the error for a REFUSED answer.

    Parameters
    ----------
    answer
        The device's answer.

    Returns
    -------
    DeviceRefusedError
        With the device's reason in words and what to do about it.
    """
    return DeviceRefusedError(answer.reason, answer.detail)
