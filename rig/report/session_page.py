"""The report of a session: what its template asks for, see `session.html`.

It computes nothing: all numbers are those of the session's results.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from rig import __version__, measurands
from rig.analysis import curves
from rig.analysis.result import GOOD, Measured
from rig.films import read_films
from rig.protocol import plan
from rig.report import (
    attachments,
    estimate,
    figures,
    finding,
    parts,
    timeline,
)
from rig.report.falls import fall_figures
from rig.report.film import film_figure
from rig.results import improvements, protocol_of
from rig.results.whole import notes
from rig.sections import Sections

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rig.analysis.result import DropResult
    from rig.estimate.session import SessionEstimate
    from rig.films import Film
    from rig.protocol.protocol import Protocol
    from rig.records import Drop
    from rig.report.figure import Chart
    from rig.report.parts import Bars
    from rig.results import SessionResults
    from rig.session.reading import Reader

PAPER = (
    "J. Pantaleone, Understanding and enhancing the impact-induced tension of a falling chain, "
    "arXiv:2207.02692 (2022)"
)
SOFTWARE = (
    f"the chainrig authors, chainrig {__version__}: lab-rig controller for falling-chain and "
    "photogate experiments (2026), MIT licence"
)
_NUMERICS = ("numpy", "scipy")


@dataclass(frozen=True, slots=True)
class Material:
    """What a report is made from.

    Attributes
    ----------
    outcome
        The session's results.
    bars
        What the bars on means stand for.
    estimated
        What `rig estimate` says of the impacts, where that is wanted.
    sections
        Where a section that cannot be made is noted.
    """

    session: Reader
    outcome: SessionResults
    bars: Bars = "U95"
    estimated: SessionEstimate | None = None
    sections: Sections = field(default_factory=Sections)

    @property
    def drops(self) -> list[DropResult]:
        """All attempts at all runs, in order."""
        every = (*self.outcome.analysis.runs, *self.outcome.analysis.superseded)
        return sorted(every, key=lambda drop: (drop.run.number, drop.attempt))

    def make(self, words: str, make: Callable[..., Any], *arguments: object) -> list[Any]:
        """Return what a section consists of, less what there is not; nothing where that fails."""

        def listed() -> list[Any]:
            made = make(*arguments)
            many = isinstance(made, Iterable) and not isinstance(made, Mapping)
            return [each for each in (made if many else [made]) if each is not None]

        return self.sections.make(words, listed) or []


def session_page(material: Material) -> dict[str, Any]:
    """Return what `session.html` asks for; its sections are made as they are written."""
    session, outcome = material.session, material.outcome
    protocol = protocol_of(session)
    records = {(drop.run, drop.attempt): drop for drop in session.drops()}
    timed = [
        (record, outcome.clock.scale(record).hz, drop)
        for drop in material.drops
        if (record := records[drop.run.number, drop.attempt])
    ]
    return {
        "template": "session.html",
        "title": protocol.title,
        "simulated": session.simulated,
        "session": session,
        "outcome": outcome,
        "protocol": protocol,
        "material": material,
        "timed": timed,
        "good": GOOD,
        "created": datetime.fromisoformat(session.meta["created"]),
        "free": measurands.acceleration_in(
            {name for drop in material.drops for name in drop.quantities}
        ),
        "notes": notes(session),
        "fall": _best_fall,
        "fallen": _films,
        "paper": PAPER,
        "software": SOFTWARE,
        "versions": {"rig": __version__} | {name: version(name) for name in _NUMERICS},
        **{module.__name__.rpartition(".")[2]: module for module in _MODULES},
    }


def _best_fall(
    protocol: Protocol, timed: Iterable[tuple[Drop, Any, DropResult]]
) -> Iterator[Chart]:
    """Draw the good run that shows most: where the separation is largest, else the first."""
    none = Measured(0.0, 0.0)
    best = max(
        (drop for drop in timed if drop[-1].verdict in GOOD),
        key=lambda drop: drop[-1].quantities.get(measurands.SEPARATION.name, none).value,
        default=None,
    )
    return fall_figures(protocol, *best) if best else iter(())


def _films(session: Reader, runs: Iterable[DropResult]) -> Iterator[Chart]:
    """Draw how simulated chains fell: the first that counts, and the first that does not."""
    films = read_films(session.path) if session.simulated else {}
    shown: dict[bool, Film] = {}
    for drop in runs:
        if (film := films.get((drop.run.number, drop.attempt))) is not None:
            shown.setdefault(drop.verdict not in GOOD, film)
    return (film_figure(film) for _, film in sorted(shown.items()))


_MODULES = (
    *(attachments, curves, estimate, figures, finding, improvements),
    *(measurands, parts, plan, timeline),
)
