"""What `rig estimate` finds, in words and tables, for the terminal and the page alike."""

from __future__ import annotations

from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from rig.estimate.rods import resolution
from rig.measurands import MEASURANDS
from rig.report.columns import Column, aligned
from rig.report.numbers import MINUS, decimals_for, fixed, plus_minus
from rig.report.parts import Part

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from rig.analysis.comparison import Comparison, Difference
    from rig.estimate.alphas import ConditionAlpha
    from rig.estimate.likelihood_ratio import LikelihoodRatio
    from rig.estimate.rods import Gain, Impulses
    from rig.estimate.session import Coefficient, Coefficients, ContactPoint, SessionEstimate
    from rig.protocol.protocol import Condition
    from rig.sections import Sections

    _Make = Callable[[str, SessionEstimate], Part | None]

T = TypeVar("T")

SYMBOLS = {"alpha": "α", "restitution": "β", "friction": "μ", "pile_restitution": "β of the pile"}


class _Alpha(NamedTuple):
    """The best single α under a condition, and where its rods touch."""

    of: ConditionAlpha
    contact: ContactPoint | None


class _Compared(NamedTuple):
    """What one measurand differs by from the model under one condition."""

    quantity: str
    of: Difference


class _Rods(NamedTuple):
    """What one rod, or some that are known by their sum, gave under a condition."""

    condition: Condition
    of: Gain


def estimate_text(found: SessionEstimate, sections: Sections, *, simulated: bool) -> str:
    """Write everything for a terminal; what cannot be written is noted in `sections`."""
    lines = ["SIMULATED DATA"] if simulated else []
    lines.append(f"{found.drops} good drop{'s' * (found.drops > 1)}, {found.edges} edges")
    for heading, make in _PARTS.items():
        lines += (
            sections.make(f'The section "{heading}"', partial(_lines, heading, make, found)) or ()
        )
    return "\n".join(lines)


def _lines(heading: str, make: _Make, found: SessionEstimate) -> list[str]:
    part = make(heading, found)
    if part is None:
        return []
    table = aligned(part.columns, part.records) if part.records else []
    return ["", part.heading, *table, *part.sentences]


def page_parts(found: SessionEstimate, sections: Sections) -> Iterator[Part]:
    """Yield the same for a page, with a record for each rod too, or rods known by their sum."""
    for heading, make in (_PARTS | _PAGE_PARTS).items():
        part = sections.make(f'The section "{heading}"', partial(make, heading, found))
        if part is not None:
            yield part


def _coefficients(heading: str, found: SessionEstimate) -> Part | None:
    words = [f"{left}." for left in found.left_out or ()]
    told = found.coefficients
    if told is not None and told.parameters:
        words += _coefficient_words(told)
        return Part(heading, words, _COEFFICIENTS, told.parameters)
    return Part(heading, words) if words else None


def _single_alphas(heading: str, found: SessionEstimate) -> Part | None:
    if found.alphas is None:
        return None
    tests = [
        f"{what}: {_chi2(test)}."
        for what, test in (
            ("One α for all runs of an incline", found.alphas.runs_share_alpha),
            ("α of each incline by Eqs. 8 to 13 with these coefficients", found.alphas.by_model),
        )
        if test is not None
    ]
    contact = (
        {one.incline_deg: one for one in found.coefficients.contact} if (found.coefficients) else {}
    )
    lines = [_Alpha(one, contact.get(one.condition.incline_deg)) for one in found.alphas.inclines]
    return Part(heading, tests, _ALPHAS, lines)


def _end_correction(heading: str, found: SessionEstimate) -> Part | None:
    said = found.end_correction
    return None if said is None else Part(heading, [said.sentence])


def _impulses(heading: str, found: SessionEstimate) -> Part | None:
    said = found.impulses
    return None if said is None else Part(heading, [resolution(said)], _IMPULSES, said)


def _comparison(heading: str, found: SessionEstimate) -> Part | None:
    if not found.comparison:
        return None
    words = "The inclines share the uncertainties of the rig and of the model's parameters."
    return Part(heading, [words], _COMPARISON, found.comparison)


def _failed(heading: str, found: SessionEstimate) -> Part | None:
    words = [f"{one}." for one in found.failed]
    return Part(heading, words) if words else None


def _incline_by_incline(heading: str, found: SessionEstimate) -> Part | None:
    lines = [
        _Compared(one.quantity, line) for one in found.comparison or () for line in one.differences
    ]
    return Part(heading, (), _INCLINES, lines) if lines else None


def _single_impulses(heading: str, found: SessionEstimate) -> Part | None:
    lines = [_Rods(one.condition, gain) for one in found.impulses or () for gain in one.gains]
    return Part(heading, (), _RODS, lines) if lines else None


def _coefficient_words(told: Coefficients) -> Iterator[str]:
    names = [symbol(one.name) for one in told.parameters]
    pairs = [
        f"{one} and {other} {fixed(told.correlation[i, j], 2)}"
        for i, one in enumerate(names)
        for j, other in enumerate(names[:i])
    ]
    if pairs:
        yield f"Correlation: {', '.join(pairs)}."
    yield (
        "Least squares uses only the edges and the values marked as held. The posterior also uses "
        "the protocol's ± as priors."
    )
    if told.drag is not None:
        value, expanded = told.drag.value, told.drag.expanded
        said = "not significant"
        if abs(value) > expanded:
            said = "which slows the chains" if value > 0 else "negative, which air cannot cause"
        yield f"Air: κ = ({plus_minus(told.drag, 1e3)})·10⁻³ /m in g − κv², {said}."
    else:
        yield "Air: the edges tell κ no better than the protocol does."


def symbol(name: str) -> str:
    """Write a coefficient as its symbol; of given α's each has its chain's name."""
    what, _, chain = name.partition(" ")
    return SYMBOLS[what] + (f" of {chain}" if chain else "")


def _chi2(test: LikelihoodRatio) -> str:
    p = test.p
    assert p is not None
    verdict = "consistent" if p > 0.05 else "doubtful" if p > 0.001 else "inconsistent"
    return f"{verdict} (χ² {test.chi2:.1f} of {test.degrees}, p {p:.2g})"


def _contact(line: _Alpha) -> str:
    if line.contact is None:
        return ""
    return plus_minus(line.contact.height, 1e3) if line.contact.identified else "not identified"


def _posterior(one: Coefficient) -> str:
    digits = decimals_for(2.0 * one.sd)
    return f"{fixed(one.low, digits)} … {fixed(one.high, digits)}"


def _stated(one: Coefficient) -> str:
    value = f"{one.stated.value:g}".replace("-", MINUS)
    return value + (f" (u {one.stated.u:g})" if one.stated.u else "")


def _worst(errors: Iterable[float | None]) -> str:
    return fixed(max((abs(one) for one in errors if one is not None), default=None), 2)


def _worst_gain(impulses: Impulses) -> str:
    return _worst(gain.normalized_error for gain in impulses.gains)


def _counted(line: _Rods) -> str:
    """Count rods as people do, from 1."""
    return "–".join(str(1 + rod) for rod in dict.fromkeys((line.of.first, line.of.last)))


def _p(p: float | None) -> str:
    return "" if p is None else f"{p:.2g}"


def _condition(of: Callable[[T], Condition]) -> tuple[Column[T], Column[T]]:
    """Columns of the incline and, where chains are unlike, of the one that strikes."""
    return (
        Column("incline (°)", lambda row: f"{of(row).incline_deg:g}"),
        Column("strikes", lambda row: of(row).impact_chain or "", numeric=False),
    )


_COEFFICIENTS: tuple[Column[Coefficient], ...] = (
    Column("coefficient", lambda one: symbol(one.name), numeric=False),
    Column("least squares ± U", lambda one: plus_minus(one.least_squares)),
    Column("posterior, 95 %", _posterior),
    Column("protocol", _stated),
    Column("from", lambda one: "edges" if one.identified else "held", numeric=False),
)
_ALPHAS: tuple[Column[_Alpha], ...] = (
    *_condition(attrgetter("of.condition")),
    Column("n", lambda line: str(line.of.n)),
    Column("α ± U", lambda line: plus_minus(line.of.alpha)),
    Column("α by coefficients", lambda line: fixed(line.of.model, 5)),
    Column("contact point ± U (mm)", _contact),
)
_IMPULSES: tuple[Column[Impulses], ...] = (
    *_condition(attrgetter("condition")),
    Column("rods", lambda one: str(one.rods)),
    Column("resolved", lambda one: str(one.resolved)),
    Column("χ² of Eq. 9", lambda one: fixed(one.eq9.chi2, 1)),
    Column("p", lambda one: _p(one.eq9.p)),
    Column("largest |Eₙ|", _worst_gain),
)
_INCLINES: tuple[Column[_Compared], ...] = (
    Column("quantity", lambda line: MEASURANDS[line.quantity].symbol, numeric=False),
    *_condition(attrgetter("of.condition")),
    Column("n", lambda line: str(line.of.n)),
    Column("measured − model (mm, mm/s)", lambda line: fixed(1e3 * line.of.value, 2)),
    Column("u", lambda line: fixed(1e3 * line.of.u, 2)),
    Column("Eₙ", lambda line: fixed(line.of.normalized_error, 2)),
    Column("χ²", lambda line: fixed(line.of.chi2, 2)),
    Column("p", lambda line: _p(line.of.p)),
)
_RODS: tuple[Column[_Rods], ...] = (
    *_condition(attrgetter("condition")),
    Column("rod", _counted),
    Column("ΔV ± U (m/s)", lambda line: plus_minus(line.of.measured)),
    Column("Eq. 9 (m/s)", lambda line: fixed(line.of.eq9_m_s, 5)),
    Column("Eₙ", lambda line: fixed(line.of.normalized_error, 2)),
)
_COMPARISON: tuple[Column[Comparison], ...] = (
    Column("quantity", lambda one: MEASURANDS[one.quantity].symbol, numeric=False),
    Column("χ²", lambda one: fixed(one.chi2, 1)),
    Column("inclines", lambda one: str(one.degrees)),
    Column("p", lambda one: _p(one.p)),
    Column("largest |Eₙ|", lambda one: _worst(line.normalized_error for line in one.differences)),
)

# In order; each is made by itself, and none where there is nothing to say.
_PARTS: dict[str, _Make] = {
    "Coefficients of the impacts": _coefficients,
    "Best single α": _single_alphas,
    "End correction": _end_correction,
    "Speed gained from each rod, measured and by Eq. 9": _impulses,
    "The protocol's model": _comparison,
    "Not estimated": _failed,
}
_PAGE_PARTS: dict[str, _Make] = {
    "The protocol's model, incline by incline": _incline_by_incline,
    "Single impulses": _single_impulses,
}
