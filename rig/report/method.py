"""How the numbers of a report came about, and whom to cite for them, in words for its readers."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from rig import __version__
from rig.measurands import SEPARATION

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
    """Say in two paragraphs how the results of a session were got.

    Parameters
    ----------
    analysis
        What its scene lacks is not spoken of.
    """
    struck = any(one.run.impact is not None for one in analysis.runs)
    apart = any(SEPARATION.name in one.quantities for one in analysis.runs)
    falls = "At each impact the chain gains ΔV = V α m/(M + γ m) (the paper's Eq. 9), with α open. "
    skew = (
        "Δz is corrected to simultaneous release: the release of either chain is an unknown of "
        "each drop. "
    )
    way = "Between impacts a chain falls with" if struck else "What falls has"
    first = (
        "Photogates along the fall give an edge each time a rod enters or leaves a beam, and a "
        "board stamps it. Which edge is which rod is decided by likelihood among several falls; "
        f"edges of no rod stay in the record and out of the fit. {way} g − κv². "
        f"{falls if struck else ''}One least-squares adjustment of all unknowns of a "
        f"drop gives its results. {skew if apart else ''}Raw edges are never altered."
    )
    together = (
        "All good drops were adjusted together: the clock, the beams' heights and the chain are "
        "common unknowns, with what the protocol states behind ± as priors. "
        if analysis.joint is not None
        else "Each drop was adjusted by itself: too few are good for an adjustment of all. "
    )
    second = (
        f"{together}Standard uncertainties u come from that adjustment, where edges scatter more "
        "than allowed for with a scale that says so; U = k·u is for 95 % with effective degrees of "
        "freedom (GUM). A mean has the scatter of its runs over √n and, in full, what all runs "
        "share. Predictions carry the uncertainty of the protocol's own numbers. Eₙ is the "
        "difference of both over the expanded uncertainty of that difference, which contains the "
        "scatter of the falls themselves: 1/√n of it for a mean of n drops. Within ±1 both agree "
        "(ISO 13528)."
    )
    return first, second


def method_page() -> str:
    """Return the page on the method as Markdown; it travels with the program."""
    packed = files("rig.report").joinpath(METHOD)
    if packed.is_file():
        return packed.read_text(encoding="utf-8")
    return Path(__file__).parents[2].joinpath("docs", METHOD).read_text(encoding="utf-8")
