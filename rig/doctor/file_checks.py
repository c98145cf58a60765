"""Checks of a session file and of the disk it is on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.doctor.findings import Finding

if TYPE_CHECKING:
    from rig.doctor.facts import DiskFacts, SessionFacts

ROOM = 200 * 10**6
"""Bytes that should be free: a day of drops takes a few tens of MB, and its log as much again."""


def disk(facts: DiskFacts) -> Finding:
    """See that there is room for a session."""
    said = f"{facts.free / 1e6:.0f} MB free in {facts.folder}"
    if facts.free < ROOM:
        return Finding("disk", said, f"free {ROOM / 1e6:.0f} MB there, or keep sessions elsewhere")
    return Finding("disk", said)


def session(facts: SessionFacts) -> Finding:
    """See that a session file is whole."""
    name = f"session {facts.path}"
    if facts.foreign:
        return Finding(name, f"not a session: {facts.foreign}", "name a file made by rig run")
    if not facts.whole:
        return Finding(
            name, f"damaged: {facts.first_trouble}", f"rig recover {facts.path} -o NEW.session"
        )
    return Finding(name, f"whole, being written by {facts.writer}" if facts.writer else "whole")
