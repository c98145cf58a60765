"""What must be true of a session whatever was killed, pulled out or garbled while it was made."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rig.link.messages import pack_label
from rig.replay import replay
from rig.session.schema import RunState
from rig.session.store import Session

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path


_GOOD = (RunState.ACCEPTED, RunState.MARGINAL)
_WRAP = 1 << 32


def broken(session: Path, happened: Iterable[dict[str, Any]], planned: int) -> list[str]:
    """Compare a finished session with what the board itself logged.

    Parameters
    ----------
    session
        The file.
    happened
        The board's log, see `sim.pty`.
    planned
        How many runs the protocol has.

    Returns
    -------
    list of str
        What is wrong; empty when all is well.
    """
    held = {seen["drop"]["label"]: seen for seen in happened if "drop" in seen}
    with Session.open(session, readonly=True) as opened:
        drops = {pack_label(drop.run, drop.attempt): drop for drop in opened.drops()}
        states = opened.states()
        again = replay(opened)
    found = [f"replay: {what}" for what in again.differences]
    found += [f"lost: the board held {label:#x}" for label in held.keys() - drops.keys()]
    found += [f"invented: {label:#x}" for label in drops.keys() - held.keys()]
    for label in drops.keys() & held.keys():
        # STOP cuts the release pulse, and that is no damage to the record.
        faults = [fault for fault in drops[label].faults if not fault.code.startswith("pulse_")]
        if _edges(held[label]) != list(drops[label].edges) or faults:
            found.append(f"altered: {label:#x} {faults}")
    for run in range(1, planned + 1):
        entries = [entry for entry in states if entry.run == run]
        good = [n for n, entry in enumerate(entries) if entry.state in _GOOD]
        if good != [len(entries) - 1]:
            found.append(f"run {run} is not done once: {[str(e.state) for e in entries]}")
        attempts = [entry.attempt for entry in entries]
        if attempts != sorted(attempts):
            found.append(f"run {run}: attempts out of order")
    order = [entry.run for entry in states]
    if order != sorted(order):
        found.append("runs out of order")
    return found


def _edges(seen: dict[str, Any]) -> list[tuple[int, int, bool]]:
    """Turn the board's snapshots into edges, without the code that is being tested."""
    edges, state = [], 0
    for tick, now in seen["events"]:
        since = (tick - seen["drop"]["fire_tick"] + _WRAP // 2) % _WRAP - _WRAP // 2
        edges += [
            (since, channel, bool(now >> channel & 1))
            for channel in range(16)
            if (state ^ now) >> channel & 1
        ]
        state = now
    return edges


def longest_on(happened: Iterable[dict[str, Any]]) -> float:
    """How long the release was on at a stretch, the longest for certain, s.

    A computer with other things to do looks at the board late: what it sees on and then off was
    off, for all that is known, at once after the look before.
    """
    longest, since = 0.0, None
    for seen in happened:
        if "outputs" not in seen:
            continue
        if seen["outputs"] and since is None:
            since = seen["at_s"]
        elif not seen["outputs"] and since is not None:
            longest, since = max(longest, seen["after_s"] - since), None
    return longest
