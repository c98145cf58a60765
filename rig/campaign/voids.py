"""Voids in a row: what they have in common, and which of them are held against their runs."""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from rig.reasons import Reason, make_reason, remedies, summarize_reasons
from rig.recorder.run_lines import RunLine
from rig.records import Job
from rig.session.reading import StateEntry
from rig.session.schema import VERDICTS

MANY = 3
"""Voids of a kind in a row after which it is not the drop that is at fault."""


class Void(NamedTuple):
    """One void drop."""

    job: Job
    reasons: tuple[Reason, ...]


VoidRow = tuple[Void, ...]
"""The latest voids with no good drop between them, at most `MANY`."""


def after(row: VoidRow, job: Job, verdict: str, reasons: tuple[Reason, ...]) -> VoidRow:
    """Take one more verdict; a second one of the same drop replaces the first."""
    row = tuple(void for void in row if void.job != job)
    if verdict == "void":
        return (*row, Void(job, reasons))[-MANY:]
    return row if verdict == "rejected" else ()


def in_common(row: VoidRow) -> tuple[str, ...]:
    """Name the reasons that the last `MANY` voids share; none where there are fewer.

    Reasons are of a kind when they are the same but for their numbers.
    """
    if len(row) < MANY:
        return ()
    kinds = [{reason.kind: reason for reason in void.reasons} for void in row]
    shared = [kind for kind in kinds[-1] if all(kind in drop for drop in kinds)]
    return tuple(summarize_reasons([table[kind] for table in kinds]) for kind in shared)


def why_halted(row: VoidRow) -> str:
    """Say why nothing more is dropped, and on a second line what to do; empty while all is well."""
    reasons = in_common(row)
    if not reasons:
        return ""
    why = make_reason("halted", many=MANY, why="; ".join(reasons), run=row[-1].job.run)
    return "\n".join([why.text, *remedies([why])])


class Voids(NamedTuple):
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
    verdicts: dict[Job, str] = {}
    forgiven: set[Job] = set()
    for entry in entries:
        job = Job(entry.run, entry.attempt)
        if entry.state in VERDICTS and job not in forgiven:
            row = after(row, job, entry.state, entry.reasons)
            verdicts[job] = entry.state
        if in_common(row):
            forgiven.update(drop.job for drop in row)
            row = ()
    held = frozenset(job for job, verdict in verdicts.items() if verdict == "void")
    return Voids(row, held - forgiven, frozenset(forgiven))
