"""Feed a recorded conversation through the whole stack again, and compare the outcome."""

from collections.abc import Iterator
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

from rig.analysis.session import Progress
from rig.records import ClockSample, Drop, Pulse
from rig.results.whole import results
from rig.session.drop_check import ByteReplay, as_old_as
from rig.session.reading import Reader


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a replay found, line by line; `differences` is empty when all is identical."""

    lines: tuple[str, ...]
    differences: tuple[str, ...]


class _ByBytes(Reader):
    """A session in which drops, clock samples and pulses are what the bytes give."""

    def __init__(self, session: Reader) -> None:
        super().__init__(session.path, session.connection)
        replay = ByteReplay()
        stored = {drop.job: drop for drop in session.drops(replay)}
        self.chunks = replay.fed
        self._samples = [sample for sample in replay.records if isinstance(sample, ClockSample)]
        self._pulses = [pulse for pulse in replay.records if isinstance(pulse, Pulse)]
        # What was stored and not acknowledged any more still is in the bytes.
        due = stored.keys() | {drop.job for drop in replay.acknowledged_drops()}
        self._drops = [
            as_old_as(stored.get(job, drop), drop)
            for job, drop in sorted(replay.drops().items())
            if job in due
        ]

    def digest(self) -> None:
        return None

    def drops(self, *_: object, **__: object) -> Iterator[Drop]:
        yield from self._drops

    def pings(self, after: int = 0) -> list[ClockSample]:
        return self._samples[after:]

    def pulses(self) -> list[Pulse]:
        return self._pulses


def replay(session: Reader, progress: Progress | None = None) -> Outcome:
    """Feed the recorded bytes through the parser and the edges through the analysis.

    Drops, clock samples and results are compared with what the session holds, exactly. It may
    be recording meanwhile.
    """
    pairs: dict[str, tuple[list[Any], list[Any]]] = {}
    with session.snapshot():
        again = _ByBytes(session)
        if again.chunks:
            pairs["drops"] = list(again.drops()), sorted(session.drops(), key=attrgetter("job"))
            pairs["clock samples"] = again.pings(), session.pings()
            if any(pulses := (again.pulses(), session.pulses())):
                pairs["reference pulses"] = pulses
        stored = results(session, progress).records()
        once_more = again if again.chunks else session
        pairs["results"] = results(once_more, progress).records(), stored
    differences = tuple(what for what, (new, old) in pairs.items() if new != old)
    lines = [] if again.chunks else ["no bytes were recorded: the edges come from a file"]
    for what, (_, old) in pairs.items():
        lines.append(f"{what}: {len(old)} {'DIFFERENT' if what in differences else 'identical'}")
    lines.append(f"DIFFERENT: {', '.join(differences)}" if differences else "identical")
    return Outcome(tuple(lines), differences)
