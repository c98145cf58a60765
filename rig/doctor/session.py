"""Checks of a session file: whether it is whole, and what its board did meanwhile."""

from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

from rig.link.messages import unpack_label
from rig.link.transcript import Restart, causes
from rig.records import Drop
from rig.recover.examine import examine
from rig.selftest.findings import Finding, fail_if, make_check
from rig.session.drop_check import ByteReplay
from rig.session.store import Session


def check_session(path: str) -> Iterator[Finding]:
    """Make all checks of a session file, which stays as it is.

    Raises
    ------
    SessionError
        It became unreadable meanwhile.
    """
    whole = make_check(f"session {path}", check_whole, path)
    yield whole
    if not whole.failed:
        with Session.open(path, readonly=True) as session:
            replay = ByteReplay()
            drops = [*session.drops(replay)]
        restarts = [record for record in replay.records if isinstance(record, Restart)]
        yield make_check("restarts", check_restarts, restarts, drops)
        yield make_check("supply", describe_supply, drops)


def check_whole(path: str) -> str:
    """See that a session file is there, and whole."""
    fail_if(not Path(path).exists(), "session_missing")
    examined = examine(path)
    fail_if(examined.foreign, "no_session", text=examined.foreign)
    for trouble in examined.troubles:
        fail_if(trouble, "session_damaged", text=trouble, path=path)
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
    times: Counter[str] = Counter()
    for restart in restarts:
        job = "" if restart.label is None else f"{unpack_label(restart.label)}: "
        times[job + restart.when + causes(restart.cause)] += 1
    for drop in drops:
        if drop.certificate and drop.certificate.restarts:
            times[f"{drop.job}: before it, unseen{causes(drop.certificate.restarts)}"] += 1
    text = "; ".join(f"{when}, {n} times" if n > 1 else when for when, n in times.items())
    fail_if(text, "board_restarts", text=text)
    return "none"


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
