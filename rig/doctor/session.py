"""Checks of a session file: whether it is whole, and what its board did meanwhile."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator

from rig.link.messages import unpack_label
from rig.link.transcript import Restart, causes
from rig.records import Drop, Job
from rig.recover.examine import ExaminedFile, examine
from rig.selftest.findings import CheckFailedError, Finding, fail_if, make_check
from rig.session.drop_check import ByteReplay
from rig.session.store import Session


def check_session(path: str) -> Iterator[Finding]:
    """Make all checks of a session file, which stays as it is.

    Raises
    ------
    SessionError
        It cannot be read at all.
    """
    examined = examine(path)
    yield make_check(f"session {path}", check_whole, examined, path)
    if examined.whole:
        with Session.open(path, readonly=True) as session:
            replay = ByteReplay()
            drops = [*session.drops(replay)]
        restarts = [record for record in replay.records if isinstance(record, Restart)]
        yield make_check("restarts", check_restarts, restarts, drops)
        yield make_check("supply", describe_supply, drops)


def check_whole(examined: ExaminedFile, path: str) -> str:
    """See that a session file is whole."""
    fail_if(examined.foreign, "no_session", text=examined.foreign)
    for trouble in examined.troubles:
        raise CheckFailedError("session_damaged", text=trouble, path=path)
    writer = examined.snapshot.writer
    return f"whole, being written by {writer}" if writer else "whole"


def check_restarts(restarts: Iterable[Restart], drops: Iterable[Drop]) -> str:
    """See that the board did not restart by itself while the session was made.

    Parameters
    ----------
    restarts
        Those that its messages tell of.
    drops
        Their certificates tell of the others.
    """
    counts: Counter[str] = Counter()
    for restart in restarts:
        when = restart.when + _because(restart.cause)
        if restart.label is not None:
            when = f"{Job(*unpack_label(restart.label))}: {when}"
        counts[when] += 1
    for drop in drops:
        if drop.certificate and drop.certificate.restarts:
            counts[f"{drop.job}: before it, unseen{_because(drop.certificate.restarts)}"] = 1
    if not counts:
        return "none"
    text = "; ".join(when + (f", {n} times" if n > 1 else "") for when, n in counts.items())
    raise CheckFailedError("board_restarts", text=text)


def describe_supply(drops: Iterable[Drop]) -> str:
    """Say how far the board's supply sank while something fell."""
    dips = [
        (seen.lowest_mv / seen.supply_mv, str(drop.job), seen.supply_mv / 1e3, seen.lowest_mv / 1e3)
        for drop in drops
        if (seen := drop.certificate) and seen.supply_mv and seen.lowest_mv
    ]
    if not dips:
        return "not measured"
    _, name, at_fire, lowest = min(dips)
    return f"at most from {at_fire:.2f} V to {lowest:.2f} V, in {name}"


def _because(mask: int) -> str:
    words = causes(mask)
    return f" ({words})" if words else ""
