"""Results of `rig estimate` in words and tables, for terminal and page."""

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any

from rig.estimate.alphas import ConditionAlpha
from rig.estimate.rods import resolution
from rig.estimate.session import Coefficient, Coefficients, SessionEstimate, is_identified
from rig.report.columns import TABLES, Part, records_in, table_parts
from rig.report.numbers import MINUS, decimals_for, fixed, plus_minus
from rig.report.templates import lines
from rig.sections import Sections

SYMBOLS = {"alpha": "α", "restitution": "β", "friction": "μ", "pile_restitution": "β of the pile"}
_TEXT = ("coefficients", "alphas", "end", "impulses", "comparison", "failed")
"""Tables in order; each is made independently, and left out if empty."""
_PAGE = (*_TEXT, "inclines", "rods")
"""Tables of a page, with a record for each rod, or for rods identified only by their sum."""


def estimate_lines(found: SessionEstimate, sections: Sections) -> Iterator[str]:
    """Yield all results for a terminal; failed sections are noted in `sections`."""
    yield f"{found.drops} good drop{'s' * (found.drops > 1)}, {found.edges} edges"
    for part in page_parts(found, sections, _TEXT):
        yield from part.lines


def page_parts(
    found: SessionEstimate, sections: Sections, names: Iterable[str] = _PAGE
) -> Iterator[Part]:
    """Yield tables of ``columns.txt``; a failed table does not affect the others."""
    cells = _CELLS | {"contact": partial(_contact, found)}
    for name in names:
        with sections.alone(f'The section "{TABLES[name].heading}"'):
            words = lines("estimated", name, found, resolution, _correlation)
            yield from [*table_parts(name, records_in(name, found), words, cells)]


def symbol(name: str) -> str:
    """Return the symbol of a coefficient; stated α have their chain's name."""
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
    """Return the contact height at the incline of an α as text, mm."""
    heights = found.coefficients.contact if found.coefficients else {}
    if (height := heights.get(alpha.condition.incline_deg)) is None:
        return ""
    return plus_minus(height, 1e3) if is_identified(height) else "not identified"


def _posterior(coefficient: Coefficient) -> str:
    digits = decimals_for(2.0 * coefficient.posterior["u"])
    return " … ".join(fixed(coefficient.posterior[end], digits) for end in ("low", "high"))


def _format_stated(coefficient: Coefficient) -> str:
    u = f" (u {coefficient.stated.u:g})" if coefficient.stated.u else ""
    return f"{coefficient.stated.value:g}".replace("-", MINUS) + u


def _worst(compared: Iterable[Any]) -> float | None:
    errors = [line.normalized_error for line in compared]
    return max((abs(error) for error in errors if error is not None), default=None)


_CELLS: dict[str, Callable[[Any], Any]] = {
    "symbol": symbol,
    "posterior": _posterior,
    "stated": _format_stated,
    "source": lambda coefficient: "edges" if coefficient.identified else "held",
    "worst": _worst,
    "rod": lambda gain: "–".join(str(1 + n) for n in dict.fromkeys((gain.first, gain.last))),
}
