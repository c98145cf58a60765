"""Data of a session's report for its template `session.html`.

All numbers come from the session's results; nothing is computed here.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from datetime import datetime
from functools import partial
from importlib.metadata import version
from typing import Any

from rig import __version__
from rig.analysis import curves
from rig.analysis.result import GOOD
from rig.estimate.session import SessionEstimate
from rig.measurands import SEPARATION
from rig.protocol.protocol import Protocol
from rig.report import attachments, estimate, figures, finding, parts, timeline
from rig.report.falls import TimedDrop, fall_figures
from rig.report.figure import Chart
from rig.report.numbers import value_of
from rig.report.parts import Bars
from rig.results import improvements
from rig.results.whole import SessionResults, notes, protocol_of
from rig.sections import Sections
from rig.session.reading import Reader


def session_page(
    session: Reader,
    outcome: SessionResults,
    bars: Bars,
    estimated: SessionEstimate | None,
    sections: Sections,
) -> dict[str, Any]:
    """Return the data for `session.html`; sections are made when the template writes them.

    Parameters
    ----------
    session, outcome
        The session's results.
    bars
        Meaning of the bars on means.
    estimated
        Results of `rig estimate`, if wanted.
    sections
        Collects the names of failed sections.
    """
    protocol = protocol_of(session)
    # The analysis checked each drop against its bytes; damaged drops are not drawn.
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
        "versions": {"rig": __version__} | {name: version(name) for name in ("numpy", "scipy")},
        **{module.__name__.rpartition(".")[2]: module for module in _MODULES},
    }


def _make(sections: Sections, words: str, make: Callable[..., Any], *arguments: Any) -> list[Any]:
    """Return the parts of a section without empty ones; an empty list if it fails."""
    listed: list[Any] = []
    with sections.alone(words):
        parts = make(*arguments)
        many = isinstance(parts, Iterable) and not isinstance(parts, Mapping)
        listed += [part for part in (parts if many else [parts]) if part is not None]
    return listed


def _best_fall(protocol: Protocol, timed: Iterable[TimedDrop]) -> Iterator[Chart]:
    """Return the figures of the good run with the largest separation, or of the first."""
    good = [drop for drop in timed if drop[-1].verdict in GOOD]
    good.sort(key=lambda drop: -(value_of(drop[-1].quantities.get(SEPARATION.name)) or 0.0))
    return fall_figures(protocol, good[0]) if good else iter(())


_MODULES = attachments, curves, estimate, figures, finding, improvements, parts, timeline
