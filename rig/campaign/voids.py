"""Voids in a row: what they have in common, and which of them are held against their runs."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from rig.records import Job

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from rig.campaign.plan import RunLine
    from rig.session.reading import StateEntry

MANY = 3
"""Voids of a kind in a row after which it is not the drop that is at fault."""
_NUMBER = re.compile(r"[-−+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_VERDICTS = ("accepted", "marginal", "void", "rejected")


class Void(NamedTuple):
    """One void drop."""

    job: Job
    reasons: tuple[str, ...]


VoidRow = tuple[Void, ...]
"""The latest voids with no good drop between them, at most `MANY`."""


def after(row: VoidRow, job: Job, verdict: str, reasons: tuple[str, ...]) -> VoidRow:
    """Take one more verdict; a second one of the same drop replaces the first."""
    if row and row[-1].job == job:
        row = row[:-1]
    if verdict == "void":
        return (*row, Void(job, reasons))[-MANY:]
    return row if verdict == "rejected" else ()


def in_common(row: VoidRow) -> tuple[str, ...]:
    """Name the reasons that the last `MANY` voids share; none where there are fewer.

    Reasons are of a kind when they are the same without their numbers. A number that is not the
    same in all of them is shown as ``…``.
    """
    if len(row) < MANY:
        return ()
    found = []
    for reason in row[-1].reasons:
        kind = _NUMBER.split(reason)
        alike = [
            next((one for one in void.reasons if _NUMBER.split(one) == kind), None) for void in row
        ]
        if None not in alike:
            numbers = zip(*(_NUMBER.findall(one) for one in alike if one), strict=True)
            shown = [each[0] if len(set(each)) == 1 else "…" for each in numbers]
            found.append("".join(a + b for a, b in zip(kind, [*shown, ""], strict=True)))
    return tuple(dict.fromkeys(found))


def why_halted(row: VoidRow) -> str:
    """Say why nothing more is dropped, and on a second line what to do; empty while all is well."""
    reasons = in_common(row)
    if not reasons:
        return ""
    return (
        f"the last {MANY} drops are void for the same reason: {'; '.join(reasons)}\n"
        f"put that right at the rig, then go on: run {row[-1].job.run} is tried again"
    )


@dataclass(frozen=True, slots=True)
class Voids:
    """What the log of a session says of voids.

    Attributes
    ----------
    row
        As it is now.
    held
        Void attempts that are held against their runs.
    forgiven
        Those for which the campaign halted: not the run was at fault, and it is tried again.
    """

    row: VoidRow = ()
    held: frozenset[Job] = frozenset()
    forgiven: frozenset[Job] = frozenset()

    def counts(self, runs: Iterable[RunLine] = ()) -> Mapping[int, int]:
        """Count those held against each run, with what was heard of since the log was read."""
        heard = {Job(line.run, line.attempt) for line in runs if line.state == "void"}
        return Counter(job.run for job in self.held | heard - self.forgiven)


def voids_of(entries: Iterable[StateEntry]) -> Voids:
    """Go through the log of a session."""
    row: VoidRow = ()
    held: set[Job] = set()
    forgiven: set[Job] = set()
    for entry in entries:
        job = Job(entry.run, entry.attempt)
        if entry.state not in _VERDICTS or job in forgiven:
            continue
        row = after(row, job, entry.state, entry.reasons)
        held.discard(job)
        if entry.state == "void":
            held.add(job)
        if in_common(row):
            forgiven.update(one.job for one in row)
            row = ()
    return Voids(row, frozenset(held - forgiven), frozenset(forgiven))
