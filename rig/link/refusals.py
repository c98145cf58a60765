"""What a refusal means, and what the user can do about it."""

from rig.errors import DeviceError
from rig.link.messages import PROTOCOL_VERSION, DisarmReason, RefusalReason, channels_of
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
        Why the device had disarmed itself before, where that is the cause: it is not armed.
    """

    def __init__(self, reason: RefusalReason, detail: int, disarmed: DisarmReason | None = None):
        if reason is not RefusalReason.NOT_ARMED:
            disarmed = None
        code = f"disarmed_{disarmed.name}" if disarmed else f"refused_{reason.name}"
        values: dict[RefusalReason, dict[str, object]] = {
            RefusalReason.GATE_BLOCKED: {"channels": channels_of(detail)},
            RefusalReason.GATE_UNSTEADY: {"channels": channels_of(detail)},
            RefusalReason.HOLDING_A_DROP: {"run": detail},
            RefusalReason.VERSION: {"firmware": detail, "program": PROTOCOL_VERSION},
            RefusalReason.COOLING: {"rest_s": detail / 1000},
            RefusalReason.NOT_KEPT: {"first": detail},
        }
        why = make_reason(code.lower(), **values.get(reason, {}))
        super().__init__(why.text, *remedies([why]))
        self.reasons = (why,)
        self.reason = reason
        self.detail = detail
        self.disarmed = disarmed
