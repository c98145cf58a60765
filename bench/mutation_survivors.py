"""Faults that no test can or need notice, and why."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bench.mutators import Fault

_WHY: dict[tuple[str, str, str], str] = {
    ("firmware/core/device.c", "1", "2"): "any number but 0 begins the sequence again as well",
    (
        "firmware/core/device.c",
        "==",
        "!=",
    ): "what is done seldom is done in all other turns: nothing is late by that",
    (
        "firmware/core/events.c",
        "<",
        "<=",
    ): "one tick in a mark that only says that a stamp may be late",
    (
        "rig/analysis/faults.py",
        "0.015",
        "0.03",
    ): "steps of a search that is refined from where it is best",
    (
        "rig/analysis/faults.py",
        "0.10",
        "0.2",
    ): "how far a search looks; nothing promised hangs on its end",
    ("rig/analysis/fit.py", "True", "False"): "guards two lists that always have the same length",
    (
        "rig/analysis/gravity.py",
        "top + speed**2 / (2.0 * fall)",
        "(top - speed ** 2 / (2.0 * fall))",
    ): "the same: height is linear in the equations, so a step takes it there from anywhere",
    ("rig/link/port.py", "0", "1"): "the same: the call that follows overwrites it",
    (
        "rig/model/fall.py",
        "1e-100",
        "2e-100",
    ): "a limit of rescaling: both are far from where squares leave the floats",
    (
        "rig/recorder/controller.py",
        "opened.commit()",
        "pass",
    ): "the next commit of the log takes it along, a moment later",
    (
        "rig/recorder/recorder.py",
        "10_000",
        "10001",
    ): "a choice: nothing promised hangs on a millisecond",
    ("rig/session/reading.py", "22", "23"): "a limit far beyond what any timer gives in an hour",
    (
        "rig/session/store.py",
        "False",
        "True",
    ): "the same once read: JSON may write a letter as its number",
    ("rig/link/port.py", "check_name(url)", "pass"): "the simulation looks at its own name again",
    ("rig/link/client.py", "6.0", "12.0"): "a patience: longer than the 5 s that it is for",
}


def why(path: str, fault: Fault) -> str:
    """Say why it may stay; nothing where nobody has looked yet."""
    return _WHY.get((path, fault.old, fault.new), "")
