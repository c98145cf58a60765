"""What a refusal means, and what the user can do about it."""

from __future__ import annotations

from rig.boards import GATES
from rig.errors import DeviceError
from rig.link.messages import PROTOCOL_VERSION, DisarmReason, RefusalReason
from rig.reasons import make_reason, remedies


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
        if disarmed is None:
            code, values = f"refused_{reason.name.lower()}", _values(reason, detail)
        else:
            code, values = f"disarmed_{disarmed.name.lower()}", {}
        why = make_reason(code, **values)
        super().__init__(why.text, *remedies([why]))
        self.reasons = (why,)
        self.reason = reason
        self.detail = detail
        self.disarmed = disarmed


def _values(reason: RefusalReason, detail: int) -> dict[str, object]:
    """Return what the detail of a refusal says."""
    match reason:
        case RefusalReason.GATE_BLOCKED | RefusalReason.GATE_UNSTEADY:
            return {"channels": [n for n in range(GATES) if detail >> n & 1]}
        case RefusalReason.HOLDING_A_DROP:
            return {"run": detail}
        case RefusalReason.VERSION:
            return {"firmware": detail, "program": PROTOCOL_VERSION}
        case RefusalReason.COOLING:
            return {"rest_s": detail / 1000}
        case RefusalReason.NOT_KEPT:
            return {"first": detail}
    return {}
