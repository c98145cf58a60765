"""Faults that no test can or need notice, and why."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bench.mutators import Fault

_WHY: dict[tuple[str, str, str], str] = {
    (
        "rig/link/port.py",
        "0",
        "1",
    ): "the same: the call that follows overwrites it",
    (
        "rig/recorder/recorder.py",
        "10_000",
        "10001",
    ): "a choice: nothing promised hangs on a millisecond",
    (
        "firmware/core/events.c",
        "<",
        "<=",
    ): "one tick in a mark that only says that a stamp may be late",
    (
        "rig/analysis/gravity.py",
        "top + speed**2 / (2.0 * fall)",
        "(top - speed ** 2 / (2.0 * fall))",
    ): "the same: height is linear in the equations, so that one step takes it to its place from "
    "wherever it begins",
}


def why(path: str, fault: Fault) -> str:
    """Say why it may stay; nothing where nobody has looked yet."""
    return _WHY.get((path, fault.old, fault.new), "")
