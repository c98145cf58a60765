"""What `rig estimate` finds, in words and tables, for the terminal and the page alike."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from rig.estimate.rods import resolution
from rig.report.columns import heading_of, table_parts
from rig.report.numbers import MINUS, decimals_for, fixed, plus_minus
from rig.report.templates import sentence

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from rig.estimate.rods import Gain
    from rig.estimate.session import Coefficient, Coefficients, SessionEstimate
    from rig.report.columns import Part
    from rig.sections import Sections

SYMBOLS = {"alpha": "α", "restitution": "β", "friction": "μ", "pile_restitution": "β of the pile"}
_TEXT = ("coefficients", "alphas", "end", "impulses", "comparison", "failed")
"""In order; each is made by itself, and none where there is nothing to say."""
_PAGE = (*_TEXT, "inclines", "rods")
"""A page has a record for each rod too, or rods known by their sum."""


def estimate_text(found: SessionEstimate, sections: Sections, *, simulated: bool) -> str:
    """Write everything for a terminal; what cannot be written is noted in `sections`."""
    lines = ["SIMULATED DATA"] if simulated else []
    lines.append(f"{found.drops} good drop{'s' * (found.drops > 1)}, {found.edges} edges")
    for part in page_parts(found, sections, _TEXT):
        lines += part.lines
    return "\n".join(lines)


def page_parts(
    found: SessionEstimate, sections: Sections, names: Iterable[str] = _PAGE
) -> Iterator[Part]:
    """Yield tables of ``columns.txt``, each made alone."""

    def make(name: str) -> list[Part]:
        return [*table_parts(name, *_TABLES[name](found), _CELLS)]

    for name in names:
        yield from sections.make(f'The section "{heading_of(name)}"', partial(make, name)) or ()


def symbol(name: str) -> str:
    """Write a coefficient as its symbol; of given α's each has its chain's name."""
    what, _, chain = name.partition(" ")
    return SYMBOLS[what] + (f" of {chain}" if chain else "")


def _coefficients(found: SessionEstimate) -> tuple[Sequence[Any], list[str]]:
    words, coefficients = [f"{left}." for left in found.left_out or ()], found.coefficients
    if coefficients is None or not coefficients.parameters:
        return (), words
    return coefficients.parameters, [*words, *_coefficient_words(coefficients)]


def _coefficient_words(coefficients: Coefficients) -> Iterator[str]:
    names = [symbol(parameter.name) for parameter in coefficients.parameters]
    pairs = [
        f"{name} and {other} {fixed(coefficients.correlation[i, j], 2)}"
        for i, name in enumerate(names)
        for j, other in enumerate(names[:i])
    ]
    if pairs:
        yield f"Correlation: {', '.join(pairs)}."
    yield sentence("priors")
    yield sentence("drag", coefficients.drag)


def _alphas(found: SessionEstimate) -> tuple[Sequence[Any], list[str]]:
    if found.alphas is None:
        return (), []
    tests = {"runs": found.alphas.runs_share_alpha, "model": found.alphas.by_model}
    words = [sentence("alphas", name, test) for name, test in tests.items() if test is not None]
    contacts = found.coefficients.contact if found.coefficients else ()
    contact = {point.incline_deg: point for point in contacts}
    inclines = found.alphas.inclines
    return [(alpha, contact.get(alpha.condition.incline_deg)) for alpha in inclines], words


def members(groups: Iterable[Any] | None, name: str) -> list[tuple[Any, Any]]:
    """Pair each group with each of its members."""
    return [(group, member) for group in groups or () for member in getattr(group, name)]


def _posterior(coefficient: Coefficient) -> str:
    digits = decimals_for(2.0 * coefficient.sd)
    return f"{fixed(coefficient.low, digits)} … {fixed(coefficient.high, digits)}"


def _stated(coefficient: Coefficient) -> str:
    u = f" (u {coefficient.stated.u:g})" if coefficient.stated.u else ""
    return f"{coefficient.stated.value:g}".replace("-", MINUS) + u


def _worst(lines: Iterable[Any]) -> float | None:
    errors = [line.normalized_error for line in lines]
    return max((abs(error) for error in errors if error is not None), default=None)


def _rod(gain: Gain) -> str:
    """Count rods as people do, from 1."""
    return "–".join(str(1 + rod) for rod in dict.fromkeys((gain.first, gain.last)))


_TABLES: dict[str, Callable[[SessionEstimate], tuple[Sequence[Any], list[str]]]] = {
    "coefficients": _coefficients,
    "alphas": _alphas,
    "end": lambda found: ((), [found.end_correction.sentence] if found.end_correction else []),
    "impulses": lambda found: (
        found.impulses or (),
        [] if found.impulses is None else [resolution(found.impulses)],
    ),
    "comparison": lambda found: (found.comparison or (), []),
    "failed": lambda found: ((), [f"{sentence}." for sentence in found.failed]),
    "inclines": lambda found: (members(found.comparison, "differences"), []),
    "rods": lambda found: (members(found.impulses, "gains"), []),
}
_CELLS: dict[str, Callable[[Any], Any]] = {
    "symbol": symbol,
    "posterior": _posterior,
    "stated": _stated,
    "source": lambda coefficient: "edges" if coefficient.identified else "held",
    "contact": lambda at: plus_minus(at.height, 1e3) if at.identified else "not identified",
    "worst": _worst,
    "rod": _rod,
}
