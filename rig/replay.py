"""Feed a recorded conversation through the whole stack again, and compare the outcome."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rig.link.messages import TEST_RUN
from rig.link.transcript import Transcript
from rig.records import ClockSample, Drop, Pulse
from rig.results import results

if TYPE_CHECKING:
    from rig.analysis.session import Progress
    from rig.session.reading import Reader


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a replay found, line by line; `differences` is empty when all is identical."""

    lines: tuple[str, ...]
    differences: tuple[str, ...]


def replay(session: Reader, progress: Progress | None = None) -> Outcome:
    """Feed the recorded bytes through the parser and the edges through the analysis.

    Drops, clock samples and results are compared with what the session holds, exactly. It may
    be recording meanwhile.
    """
    with session.snapshot():
        return _compared(session, progress)


def _compared(session: Reader, progress: Progress | None) -> Outcome:
    lines: list[str] = []
    differences: list[str] = []

    def compare(what: str, again: object, stored: object, count: int) -> None:
        same = again == stored
        lines.append(f"{what}: {count} {'identical' if same else 'DIFFERENT'}")
        if not same:
            differences.append(what)

    chunks, drops, pings, pulses = _from_bytes(session)
    if chunks:
        held = sorted(session.drops(), key=_key)
        compare("drops", sorted(drops, key=_key), held, len(held))
        compare("clock samples", pings, session.pings(), len(pings))
        if pulses or session.pulses():
            compare("reference pulses", pulses, session.pulses(), len(pulses))
    else:
        lines.append("no bytes were recorded: the edges come from a file")
    stored = session.results()
    again = sorted(results(session, progress).records(), key=_number)
    if stored:
        compare("results", again, stored, len(stored))
    else:
        lines.append("results: none stored yet; rig analyze keeps them")
    lines.append("identical" if not differences else f"DIFFERENT: {', '.join(differences)}")
    return Outcome(tuple(lines), tuple(differences))


def _from_bytes(session: Reader) -> tuple[int, list[Drop], list[ClockSample], list[Pulse]]:
    """Parse the whole byte log."""
    transcript = Transcript()
    drops: list[Drop] = []
    pings: list[ClockSample] = []
    pulses: list[Pulse] = []
    chunks = 0
    for host_ns, direction, data in session.byte_log():
        chunks += 1
        for record in transcript.feed(direction, host_ns, data):
            if isinstance(record, Drop):
                if record.run != TEST_RUN:  # of the release, and of no plan
                    drops.append(record)
            elif isinstance(record, ClockSample):
                pings.append(record)
            elif isinstance(record, Pulse):
                pulses.append(record)
    # What was stored and not acknowledged any more still is in the bytes.
    have = {_key(drop) for drop in drops}
    stored = {_key(drop) for drop in session.drops()}
    drops += [d for d in transcript.unfinished() if _key(d) in stored - have]
    return chunks, _once(drops), pings, pulses


def _once(drops: list[Drop]) -> list[Drop]:
    """Leave out what was acknowledged again because the first ACKNOWLEDGE was lost on its way."""
    kept: list[Drop] = []
    for drop in drops:
        if not any(
            (one.certificate, one.fire_tick, one.edges)
            == (drop.certificate, drop.fire_tick, drop.edges)
            for one in kept
            if _key(one) == _key(drop)
        ):
            kept.append(drop)
    return kept


def _key(drop: Drop) -> tuple[int, int]:
    return drop.run, drop.attempt


def _number(result: dict[str, Any]) -> tuple[int, int]:
    return result["run"], result["attempt"]
