"""Errors as data: what a client shows is what the daemon raised."""

from __future__ import annotations

from typing import Any

from rig.errors import DeviceError, DeviceTimeoutError, InputError, RigError, SessionError
from rig.link.messages import DisarmReason, Reason
from rig.link.refusals import DeviceRefusedError


class ControlError(DeviceError):
    """Another client holds what this one asked for."""


class VersionError(RigError):
    """Client and daemon do not speak the same interface."""

    exit_code = 4


class StoppedError(DeviceError):
    """A client pressed STOP, or the one in control was lost."""


_KINDS: dict[str, type[RigError]] = {
    kind.__name__: kind
    for kind in (
        RigError,
        InputError,
        SessionError,
        DeviceError,
        DeviceTimeoutError,
        ControlError,
        StoppedError,
        VersionError,
    )
}


def to_data(error: RigError) -> dict[str, Any]:
    """Write an error down; an unknown kind becomes the nearest known one above it."""
    refused = error if isinstance(error, DeviceRefusedError) else None
    known = (kind.__name__ for kind in type(error).__mro__ if kind.__name__ in _KINDS)
    return {
        "kind": "DeviceRefusedError" if refused else next(known),
        "message": error.message,
        "hint": error.hint,
        "exit_code": error.exit_code,
        "reason": refused.reason.name if refused else None,
        "detail": refused.detail if refused else None,
        "disarmed": refused.disarmed.name if refused and refused.disarmed else None,
    }


def from_data(data: dict[str, Any]) -> RigError:
    """Make the error again; one of a kind this program does not know is a `RigError`."""
    if data.get("kind") == "DeviceRefusedError":
        disarmed = data.get("disarmed")
        return DeviceRefusedError(
            Reason[data["reason"]], data["detail"], DisarmReason[disarmed] if disarmed else None
        )
    kind = _KINDS.get(str(data.get("kind")), RigError)
    error = kind(str(data.get("message", "")), str(data.get("hint", "")))
    error.exit_code = int(data.get("exit_code", kind.exit_code))
    return error
