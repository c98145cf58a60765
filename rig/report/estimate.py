"""What `rig estimate` finds, in words and tables, for the terminal and the page alike."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from rig.estimate.rods import resolution
from rig.report.columns import table_parts
from rig.report.numbers import MINUS, decimals_for, fixed, plus_minus
from rig.report.templates import sentence

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from rig.analysis.comparison import Difference
    from rig.estimate.rods import Gain
    from rig.estimate.session import Coefficient, Coefficients, ContactPoint, SessionEstimate
    from rig.report.columns import Part
    from rig.sections import Sections

    _Maker = Callable[[SessionEstimate], Iterator[Part]]

SYMBOLS = {"alpha": "α", "restitution": "β", "friction": "μ", "pile_restitution": "β of the pile"}


def estimate_text(found: SessionEstimate, sections: Sections, *, simulated: bool) -> str:
    """Write everything for a terminal; what cannot be written is noted in `sections`."""
    lines = ["SIMULATED DATA"] if simulated else []
    lines.append(f"{found.drops} good drop{'s' * (found.drops > 1)}, {found.edges} edges")
    for part in _parts(found, sections, _MAKERS):
        lines += part.lines
    return "\n".join(lines)


def page_parts(found: SessionEstimate, sections: Sections) -> Iterator[Part]:
    """Yield the same for a page, with a record for each rod too, or rods known by their sum."""
    return _parts(found, sections, _MAKERS | _PAGE_MAKERS)


def _parts(found: SessionEstimate, sections: Sections, makers: dict[str, _Maker]) -> Iterator[Part]:
    for words, make in makers.items():
        yield from sections.make(f'The section "{words}"', partial(_made, make, found)) or ()


def _made(make: _Maker, found: SessionEstimate) -> list[Part]:
    return [*make(found)]


def _coefficients(found: SessionEstimate) -> Iterator[Part]:
    words = [f"{left}." for left in found.left_out or ()]
    coefficients = found.coefficients
    parameters = coefficients.parameters if coefficients else ()
    if coefficients is not None and parameters:
        words += _coefficient_words(coefficients)
    return table_parts(
        "coefficients",
        parameters,
        words,
        coefficient=lambda coefficient: symbol(coefficient.name),
        posterior=_posterior,
        stated=_stated,
        source=lambda coefficient: "edges" if coefficient.identified else "held",
    )


def _single_alphas(found: SessionEstimate) -> Iterator[Part]:
    if found.alphas is None:
        return iter(())
    tests = {"runs": found.alphas.runs_share_alpha, "model": found.alphas.by_model}
    words = [sentence("alphas", name, test) for name, test in tests.items() if test is not None]
    contacts = found.coefficients.contact if found.coefficients else ()
    contact = {point.incline_deg: _contact(point) for point in contacts}
    alphas = [{"of": alpha, "condition": alpha.condition} for alpha in found.alphas.inclines]
    return table_parts(
        "alphas",
        alphas,
        words,
        contact=lambda alpha: contact.get(alpha["condition"].incline_deg, ""),
    )


def _end_correction(found: SessionEstimate) -> Iterator[Part]:
    return table_parts("end", (), [found.end_correction.sentence] if found.end_correction else ())


def _impulses(found: SessionEstimate) -> Iterator[Part]:
    words = [] if found.impulses is None else [resolution(found.impulses)]
    return table_parts(
        "impulses", found.impulses or (), words, worst=lambda impulses: _worst(impulses.gains)
    )


def _comparison(found: SessionEstimate) -> Iterator[Part]:
    return table_parts(
        "comparison", found.comparison or (), worst=lambda compared: _worst(compared.differences)
    )


def _failed(found: SessionEstimate) -> Iterator[Part]:
    return table_parts("failed", (), [f"{sentence}." for sentence in found.failed])


def _incline_by_incline(found: SessionEstimate) -> Iterator[Part]:
    return table_parts(
        "inclines",
        (
            {"of": difference, "condition": difference.condition, "quantity": compared.quantity}
            for compared in found.comparison or ()
            for difference in compared.differences
        ),
    )


def _single_impulses(found: SessionEstimate) -> Iterator[Part]:
    gains = (
        {"of": gain, "condition": rods.condition}
        for rods in found.impulses or ()
        for gain in rods.gains
    )
    # Count rods as people do, from 1.
    return table_parts(
        "rods",
        gains,
        rod=lambda rods: "–".join(
            str(1 + rod) for rod in dict.fromkeys((rods["of"].first, rods["of"].last))
        ),
    )


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
    yield sentence("drag", coefficients.drag, plus_minus(coefficients.drag, 1e3))


def symbol(name: str) -> str:
    """Write a coefficient as its symbol; of given α's each has its chain's name."""
    what, _, chain = name.partition(" ")
    return SYMBOLS[what] + (f" of {chain}" if chain else "")


def _contact(contact: ContactPoint) -> str:
    return plus_minus(contact.height, 1e3) if contact.identified else "not identified"


def _posterior(coefficient: Coefficient) -> str:
    digits = decimals_for(2.0 * coefficient.sd)
    return f"{fixed(coefficient.low, digits)} … {fixed(coefficient.high, digits)}"


def _stated(coefficient: Coefficient) -> str:
    value = f"{coefficient.stated.value:g}".replace("-", MINUS)
    return value + (f" (u {coefficient.stated.u:g})" if coefficient.stated.u else "")


def _worst(lines: Iterable[Gain | Difference]) -> float | None:
    errors = [line.normalized_error for line in lines]
    return max((abs(error) for error in errors if error is not None), default=None)


_MAKERS: dict[str, _Maker] = {
    "Coefficients of the impacts": _coefficients,
    "Best single α": _single_alphas,
    "End correction": _end_correction,
    "Speed gained from each rod, measured and by Eq. 9": _impulses,
    "The protocol's model": _comparison,
    "Not estimated": _failed,
}
"""In order; each is made by itself, and none where there is nothing to say."""
_PAGE_MAKERS: dict[str, _Maker] = {
    "The protocol's model, incline by incline": _incline_by_incline,
    "Single impulses": _single_impulses,
}
