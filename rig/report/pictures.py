"""Which figures a report gets: those its scene has data for."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from rig.analysis.result import GOOD
from rig.measurands import SEPARATION, SPEED, acceleration_in
from rig.report.bars import LABELS
from rig.report.budget import budget_figure
from rig.report.embed import PageFigure
from rig.report.figures import gravity_figure, incline_figure, runs_figure, unanswered
from rig.report.film import film_figure

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rig.analysis.result import DropResult
    from rig.analysis.session import Analysis
    from rig.films import Film
    from rig.report.bars import Bars
    from rig.sections import Sections

_GAP = (
    " Hatched: inclines below arctan μ, where the rods would not slide and the model has no answer."
)


def pictures(
    analysis: Analysis,
    curves: Mapping[str, Any] | None = None,
    simulated: bool = False,
    *,
    skew_limit_s: float | None = None,
    site_m_s2: float | None = None,
    bars: Bars = "U95",
    films: Mapping[tuple[int, int], Film] | None = None,
    sections: Sections,
) -> list[PageFigure]:
    """Draw the figures of a report.

    Parameters
    ----------
    curves
        The model, see `incline_figure`.
    simulated
        Whether to stamp them.
    skew_limit_s
        Beyond which a run is void, s.
    site_m_s2
        Expected gravity, for scenes without a surface.
    bars
        What the bars on means of several runs stand for.
    films
        Of simulated drops, by run and attempt; the first that counts is shown, and the first that
        does not, which may have ended in a pile.
    sections
        Where a figure that cannot be drawn is noted.
    """
    measured = {name for one in analysis.runs for name in one.quantities}
    two = SEPARATION.name in measured
    drawn: list[PageFigure | None] = []

    def add(draw: Callable[[], str], alt: str, caption: str, place: str = "results") -> None:
        figure = sections.make(
            f'The figure "{alt}"', lambda: PageFigure(draw(), alt, caption, place)
        )
        drawn.append(figure)

    if two or SPEED.name in measured:
        both = "Separation and end speed" if two else "End speed"
        apart = "Separation and speed" if two else "Speed"
        chain = "impact chain" if two else "chain"
        add(
            lambda: incline_figure(analysis, curves, simulated, bars),
            f"{both} against incline",
            f"{apart} of the {chain}'s top rod as it reaches the surface, against incline. "
            "Lines: the model, with its U (95 %) as a band. Below each: measured minus "
            "predicted, with U (95 %) of that difference. Bars on means: "
            f"{LABELS[bars]}." + (_GAP if unanswered(curves or {}) else ""),
        )
    if two:
        add(
            lambda: runs_figure(analysis, simulated, skew_limit_s),
            "Runs in order",
            "Every run, in the order of recording. Bars are expanded uncertainties (95 %). "
            "Markers show which chain struck. If the markers differ, the chains differ. If "
            "a skew stays when the chains change places, it belongs to the sides.",
            "drops",
        )
    if acceleration_in(measured):
        add(
            lambda: gravity_figure(analysis, simulated, site_m_s2),
            "Acceleration of each run",
            "Acceleration of each run. Bars are expanded uncertainties (95 %).",
        )
    for drop, film in _filmed(analysis, films or {}):
        verdict = "" if drop.verdict in GOOD else f" ({drop.verdict})"
        add(
            partial(film_figure, film),
            f"How run {drop.run.number} fell",
            f"Run {drop.run.number}{verdict}, simulated at {film.incline_deg:g}°: the impact "
            "chain from the front and, below, along its rods. Slack strings are dotted.",
            "impacts",
        )
    drawn.append(
        sections.make("The figure of the budget", lambda: budget_figure(analysis, simulated))
    )
    return [figure for figure in drawn if figure is not None]


def _filmed(
    analysis: Analysis, films: Mapping[tuple[int, int], Film]
) -> list[tuple[DropResult, Film]]:
    """Choose the drops whose films are shown."""
    with_film = [one for one in analysis.runs if (one.run.number, one.attempt) in films]
    good, other = (
        [one for one in with_film if (one.verdict in GOOD) is counts][:1]
        for counts in (True, False)
    )
    return [(one, films[one.run.number, one.attempt]) for one in good + other]
