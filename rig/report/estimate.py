"""What `rig estimate` finds, in words and tables, for the terminal and the page alike."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from rig.estimate.rods import resolution
from rig.report.columns import heading_of, records_in, table_parts
from rig.report.numbers import MINUS, decimals_for, fixed, plus_minus
from rig.report.templates import lines

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from rig.estimate.alphas import ConditionAlpha
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
    text = ["SIMULATED DATA"] if simulated else []
    text.append(f"{found.drops} good drop{'s' * (found.drops > 1)}, {found.edges} edges")
    for part in page_parts(found, sections, _TEXT):
        text += part.lines
    return "\n".join(text)


def page_parts(
    found: SessionEstimate, sections: Sections, names: Iterable[str] = _PAGE
) -> Iterator[Part]:
    """Yield tables of ``columns.txt``, each made alone."""

    def make(name: str) -> list[Part]:
        words = lines("estimated", name, found, resolution, _correlation)
        cells = _CELLS | {"contact": partial(_contact, found)}
        return [*table_parts(name, records_in(name, found), words, cells)]

    for name in names:
        yield from sections.make(f'The section "{heading_of(name)}"', partial(make, name)) or ()


def symbol(name: str) -> str:
    """Write a coefficient as its symbol; of given α's each has its chain's name."""
    what, _, chain = name.partition(" ")
    return SYMBOLS[what] + (f" of {chain}" if chain else "")


def _correlation(coefficients: Coefficients) -> list[str]:
    names = [symbol(parameter.name) for parameter in coefficients.parameters]
    return [
        f"{name} and {other} {fixed(coefficients.correlation[i, j], 2)}"
        for i, name in enumerate(names)
        for j, other in enumerate(names[:i])
    ]


def _contact(found: SessionEstimate, alpha: ConditionAlpha) -> str:
    """Say where the rods touch at the incline of an α, mm."""
    for point in found.coefficients.contact if found.coefficients else ():
        if point.incline_deg == alpha.condition.incline_deg:
            return plus_minus(point.height, 1e3) if point.identified else "not identified"
    return ""


def _posterior(coefficient: Coefficient) -> str:
    digits = decimals_for(2.0 * coefficient.sd)
    return f"{fixed(coefficient.low, digits)} … {fixed(coefficient.high, digits)}"


def _stated(coefficient: Coefficient) -> str:
    u = f" (u {coefficient.stated.u:g})" if coefficient.stated.u else ""
    return f"{coefficient.stated.value:g}".replace("-", MINUS) + u


def _worst(compared: Iterable[Any]) -> float | None:
    errors = [line.normalized_error for line in compared]
    return max((abs(error) for error in errors if error is not None), default=None)


def _rod(gain: Gain) -> str:
    """Count rods as people do, from 1."""
    return "–".join(str(1 + rod) for rod in dict.fromkeys((gain.first, gain.last)))


_CELLS: dict[str, Callable[[Any], Any]] = {
    "symbol": symbol,
    "posterior": _posterior,
    "stated": _stated,
    "source": lambda coefficient: "edges" if coefficient.identified else "held",
    "worst": _worst,
    "rod": _rod,
}
