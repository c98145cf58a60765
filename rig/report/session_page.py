"""The report of a session: what its template asks for, see `session.html`.

It computes nothing: all numbers are those of the session's results.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import datetime
from functools import partial
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from rig import __version__
from rig.analysis import curves
from rig.analysis.result import GOOD
from rig.films import read_films
from rig.measurands import SEPARATION
from rig.protocol import plan
from rig.report import attachments, estimate, figures, finding, parts, timeline
from rig.report.falls import fall_figures
from rig.report.film import film_figure
from rig.report.numbers import value_of
from rig.results import improvements, protocol_of
from rig.results.whole import notes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rig.analysis.result import DropResult
    from rig.estimate.session import SessionEstimate
    from rig.protocol.protocol import Protocol
    from rig.records import Drop
    from rig.report.figure import Chart
    from rig.report.parts import Bars
    from rig.results import SessionResults
    from rig.sections import Sections
    from rig.session.reading import Reader


def session_page(
    session: Reader,
    outcome: SessionResults,
    bars: Bars,
    estimated: SessionEstimate | None,
    sections: Sections,
) -> dict[str, Any]:
    """Return what `session.html` asks for; its sections are made as they are written.

    Parameters
    ----------
    session, outcome
        The session's results.
    bars
        What the bars on means stand for.
    estimated
        What `rig estimate` says of the impacts, where that is wanted.
    sections
        Where a section that cannot be made is noted.
    """
    protocol = protocol_of(session)
    # Each was compared with its bytes as it was analysed; of those that are damaged none is drawn.
    whole = [drop for drop in outcome.analysis.drops if not drop.damaged]
    records = ((session.drop(drop.run.number, drop.attempt), drop) for drop in whole)
    return {
        "template": "session.html",
        "title": protocol.title,
        "simulated": session.simulated,
        "session": session,
        "outcome": outcome,
        "protocol": protocol,
        "timed": [(raw, outcome.clock.scale(raw).hz, drop) for raw, drop in records if raw],
        "bars": bars,
        "estimated": estimated,
        "sections": sections,
        "make": partial(_make, sections),
        "good": GOOD,
        "created": datetime.fromisoformat(session.meta["created"]),
        "notes": notes(session),
        "fall": _best_fall,
        "fallen": _films,
        "versions": {"rig": __version__} | {name: version(name) for name in ("numpy", "scipy")},
        **{module.__name__.rpartition(".")[2]: module for module in _MODULES},
    }


def _make(sections: Sections, words: str, make: Callable[..., Any], *arguments: Any) -> list[Any]:
    """Return what a section consists of, less what there is not; nothing where that fails."""

    def listed() -> list[Any]:
        parts = make(*arguments)
        many = isinstance(parts, Iterable) and not isinstance(parts, Mapping)
        return [part for part in (parts if many else [parts]) if part is not None]

    return sections.make(words, listed) or []


def _best_fall(
    protocol: Protocol, timed: Iterable[tuple[Drop, Any, DropResult]]
) -> Iterator[Chart]:
    """Draw the good run that shows most: where the separation is largest, else the first."""
    good = [drop for drop in timed if drop[-1].verdict in GOOD]
    good.sort(key=lambda drop: -(value_of(drop[-1].quantities.get(SEPARATION.name)) or 0.0))
    return fall_figures(protocol, *good[0]) if good else iter(())


def _films(session: Reader, runs: Iterable[DropResult]) -> Iterator[Chart]:
    """Draw how simulated chains fell: the first that counts, and the first that does not."""
    films = read_films(session.path) if session.simulated else {}
    drops = [(films.get((drop.run.number, drop.attempt)), drop.verdict in GOOD) for drop in runs]
    for counts in (True, False):
        shown = [film for film, good in drops if film is not None and good is counts]
        yield from map(film_figure, shown[:1])


_MODULES = attachments, curves, estimate, figures, finding, improvements, parts, plan, timeline
