"""The method behind the numbers of a report, and what to cite for them."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from rig import __version__
from rig.measurands import SEPARATION, acceleration_in

if TYPE_CHECKING:
    from rig.analysis.session import Analysis

METHOD = "method.md"
PAPER = (
    "J. Pantaleone, Understanding and enhancing the impact-induced tension of a falling chain, "
    "arXiv:2207.02692 (2022)"
)
SOFTWARE = (
    f"the chainrig authors, chainrig {__version__}: lab-rig controller for falling-chain and "
    "photogate experiments (2026), MIT licence"
)


def method_words(analysis: Analysis) -> tuple[str, str]:
    """Return the method of a session's analysis in two paragraphs.

    Parameters
    ----------
    analysis
        Where it decides which equations were used.
    """
    struck = any(drop.run.impact is not None for drop in analysis.runs)
    apart = any(SEPARATION.name in drop.quantities for drop in analysis.runs)
    measured = acceleration_in({name for drop in analysis.runs for name in drop.quantities})
    pull = measured.symbol if measured else "g"
    impact = (
        "At each impact the chain gains ΔV = V α m/(M + γ m) (the paper's Eq. 9), with α free. "
    )
    skew = "Δz is corrected to simultaneous release, since both release times are fitted. "
    drop = (
        "A photogate gives an edge each time its beam is blocked or cleared, and a board "
        "time-stamps it. Edges are assigned by likelihood among several falls; unexplained "
        "edges stay in the record and out of the fit. "
        f"The acceleration{' between impacts' if struck else ''} is {pull} − κv². "
        f"{impact if struck else ''}One least-squares fit of all unknowns of a drop gives its "
        f"results. {skew if apart else ''}Raw edges are never altered."
    )
    together = (
        "All good drops were fitted together. They share the clock, the beam heights and the "
        "dimensions as unknowns; the protocol's ± values are their priors. "
        if analysis.rig is not None
        else "Each drop was fitted alone: there are too few good drops for a joint fit. "
    )
    session = (
        f"{together}Standard uncertainties u come from that fit. Where edges scatter more than "
        "stated, u is enlarged to match, and a remark says so. U = k·u covers 95 % with effective "
        "degrees of freedom (GUM). The uncertainty of a mean combines the scatter of its runs "
        "over √n with everything that all runs share. Predictions carry the uncertainty of the "
        "protocol's own numbers. Eₙ is the difference between measurement and prediction over the "
        "expanded uncertainty of that difference, which contains the scatter of the falls "
        "themselves: 1/√n of it for a mean of n drops. Within ±1 they agree (ISO 13528)."
    )
    return drop, session


def method_page() -> str:
    """Return the page on the method as Markdown; it travels with the program."""
    packed = files("rig.report").joinpath(METHOD)
    if packed.is_file():
        return packed.read_text(encoding="utf-8")
    return Path(__file__).parents[2].joinpath("docs", METHOD).read_text(encoding="utf-8")
