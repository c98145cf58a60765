"""What can be predicted but not measured: the rig drops chains from rest, in air as it is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.errors import InputError
from rig.protocol.scene import AT_REST

if TYPE_CHECKING:
    from rig.protocol.scene import Protocol


def unmeasurable(protocol: Protocol) -> list[str]:
    """Say why the edges of such a drop could not be read, a clause a reason; empty if they can."""
    found = []
    if protocol.initial_speed != AT_REST:
        found.append("initial_speed: the rig lets its chains go from rest")
    if protocol.drag is not None:
        found.append("drag: what the air takes is found from the edges")
    return found


def check_measurable(protocol: Protocol) -> None:
    """Refuse a protocol that can only be predicted.

    Raises
    ------
    InputError
        With every reason.
    """
    reasons = unmeasurable(protocol)
    if reasons:
        raise InputError(
            f"{protocol.source}: only predicted, never measured, because of {'; '.join(reasons)}",
            "rig predict says what the model expects; to measure, leave these keys out",
        )
