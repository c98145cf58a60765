"""What `rig estimate` finds, in words and tables, for the terminal and the page alike."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from rig.measurands import MEASURANDS, SEPARATION
from rig.report.columns import Column, aligned
from rig.report.numbers import decimals_for, fixed, plus_minus, value_of
from rig.report.parts import Part

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from rig.sections import Sections

    Record = Mapping[str, Any]
    _Make = Callable[[str, Record], Part | None]

SYMBOLS = {"alpha": "α", "restitution": "β", "friction": "μ", "pile_restitution": "β of the pile"}


def estimate_text(found: Mapping[str, Any], sections: Sections) -> str:
    """Write everything for a terminal; what cannot be written is noted in `sections`."""
    lines = ["SIMULATED DATA"] if found.get("simulated") else []
    lines.append(f"{found['drops']} good drops, {found['edges']} edges")
    for heading, make in _PARTS.items():
        lines += (
            sections.make(f'The section "{heading}"', partial(_lines, heading, make, found)) or ()
        )
    return "\n".join(lines)


def _lines(heading: str, make: _Make, found: Record) -> list[str]:
    part = make(heading, found)
    if part is None:
        return []
    table = aligned(part.columns, part.records) if part.records else []
    return ["", part.heading, *table, *part.sentences]


def page_parts(found: Mapping[str, Any], sections: Sections) -> Iterator[Part]:
    """Yield the same for a page, with a record for each rod too, or rods known by their sum."""
    for heading, make in (_PARTS | _PAGE_PARTS).items():
        part = sections.make(f'The section "{heading}"', partial(make, heading, found))
        if part is not None:
            yield part


def _coefficients(heading: str, found: Record) -> Part | None:
    if found.get("parameters"):
        return Part(heading, _coefficient_words(found), _COEFFICIENTS, found["parameters"])
    words = [f"{left}." for left in found.get("left_out") or ()]
    return Part(heading, words) if words else None


def _single_alphas(heading: str, found: Record) -> Part | None:
    if not found.get("alpha"):
        return None
    return Part(heading, list(_tests(found)), _ALPHAS, _with_contact(found))


def _end_correction(heading: str, found: Record) -> Part | None:
    said = found.get("end_correction")
    return Part(heading, [said["sentence"]]) if said else None


def _impulses(heading: str, found: Record) -> Part | None:
    said = found.get("impulses")
    return Part(heading, [said["sentence"]], _IMPULSES, said["inclines"]) if said else None


def _comparison(heading: str, found: Record) -> Part | None:
    if not found.get("comparison"):
        return None
    words = "Uncertainties of the rig and of the model's parameters are common to the inclines."
    return Part(heading, [words], _COMPARISON, found["comparison"])


def _failed(heading: str, found: Record) -> Part | None:
    words = [f"{one}." for one in found.get("failed") or ()]
    return Part(heading, words) if words else None


def _incline_by_incline(heading: str, found: Record) -> Part | None:
    inclines = [
        {"quantity": one["quantity"], **line}
        for one in found.get("comparison") or ()
        for line in one["inclines"]
    ]
    return Part(heading, (), _INCLINES, inclines) if inclines else None


def _single_impulses(heading: str, found: Record) -> Part | None:
    rods = [
        {**line, **group}
        for line in (found.get("impulses") or {}).get("inclines", ())
        for group in line["groups"]
    ]
    folded = "Speed gained from each rod, from the bottom"
    return Part(heading, (), _RODS, rods, folded) if rods else None


def _coefficient_words(found: Record) -> list[str]:
    words = [f"{left}." for left in found["left_out"]]
    names = found.get("correlation", {}).get("names", ())
    matrix = found.get("correlation", {}).get("matrix", ())
    pairs = [
        f"{symbol(one)} and {symbol(other)} {fixed(matrix[i][j], 2)}"
        for i, one in enumerate(names)
        for j, other in enumerate(names[:i])
    ]
    if pairs:
        words.append(f"Correlation: {', '.join(pairs)}.")
    words.append(
        "Least squares takes nothing from the protocol but what is marked as held; the posterior "
        "has the protocol's ± as prior."
    )
    if found.get("drag_per_m"):
        drag = found["drag_per_m"]
        seen = abs(drag["value"]) > drag["U95"]
        words.append(
            f"Air: κ = ({plus_minus(drag, 1e6)})·10⁻⁶ /m in g − κv², "
            + ("which slows the chains." if seen else "none to be seen.")
        )
    elif "drag_per_m" in found and has_free_chain(found):
        words.append("Air drag is not fitted: it takes a free chain, and rods that are all alike.")
    return words


def symbol(name: str) -> str:
    """Write a coefficient as its symbol; of given α's each has its chain's name."""
    what, _, chain = name.partition(" ")
    return SYMBOLS[what] + (f" of {chain}" if chain else "")


def has_free_chain(found: Mapping[str, Any]) -> bool:
    """Whether a chain falls beside the one that strikes."""
    return any(SEPARATION.name in curve for curve in found.get("curves") or ())


def _tests(found: Record) -> Iterator[str]:
    tests = found.get("tests") or {}
    if "runs_share_alpha" in tests:
        yield f"Runs of one incline share one α: {_chi2(tests['runs_share_alpha'])}."
    if "model" in tests:
        yield f"Eqs. 8 to 13 with these coefficients give each α: {_chi2(tests['model'])}."


def _chi2(test: Record) -> str:
    verdict = "they do" if test["p"] > 0.05 else "doubtful" if test["p"] > 0.001 else "they do not"
    return f"{verdict} (χ² {test['chi2']:.1f} of {test['degrees']}, p {test['p']:.2g})"


def _with_contact(found: Record) -> list[dict[str, Any]]:
    contact = {one["incline_deg"]: one for one in found.get("contact") or ()}
    return [{**line, **contact.get(line["incline_deg"], {})} for line in found["alpha"]["inclines"]]


def _contact(line: Record) -> str:
    if "height_m" not in line:
        return ""
    return plus_minus(line["height_m"], 1e3) if line["identified"] else "not identified"


def _posterior(line: Record) -> str:
    one = line["posterior"]
    digits = decimals_for(2.0 * one["u"])
    return f"{fixed(one['low'], digits)} … {fixed(one['high'], digits)}"


def _stated(line: Record) -> str:
    one = line["stated"]
    return f"{one['value']:g}" + (f" (u {one['u']:g})" if one["u"] else "")


def _worst(line: Record) -> str:
    return fixed(max(abs(group["normalized_error"]) for group in line["groups"]), 2)


def _p(line: Record) -> str:
    return "" if line["p"] is None else f"{line['p']:.2g}"


_STRIKES: Column[Record] = Column(
    "strikes", lambda line: str(line.get("impact_chain", "")), numeric=False
)
"""Which chain, where chains are unlike."""
_COEFFICIENTS: tuple[Column[Record], ...] = (
    Column("coefficient", lambda line: symbol(line["name"]), numeric=False),
    Column("least squares ± U", lambda line: plus_minus(line["least_squares"])),
    Column("posterior, 95 %", _posterior),
    Column("protocol", _stated),
    Column("from", lambda line: "edges" if line["identified"] else "held", numeric=False),
)
_ALPHAS: tuple[Column[Record], ...] = (
    Column("incline (°)", lambda line: f"{line['incline_deg']:g}"),
    _STRIKES,
    Column("n", lambda line: str(line["n"])),
    Column("α ± U", lambda line: plus_minus(line["alpha"])),
    Column("α by coefficients", lambda line: fixed(value_of(line.get("model")), 5)),
    Column("contact point ± U (mm)", _contact),
)
_IMPULSES: tuple[Column[Record], ...] = (
    Column("incline (°)", lambda line: f"{line['incline_deg']:g}"),
    _STRIKES,
    Column("rods", lambda line: str(line["rods"])),
    Column("resolved", lambda line: str(line["resolved"])),
    Column("χ² of Eq. 9", lambda line: fixed(line["chi2"], 1)),
    Column("p", _p),
    Column("largest |Eₙ|", _worst),
)
_INCLINES: tuple[Column[Record], ...] = (
    Column("quantity", lambda line: MEASURANDS[line["quantity"]].symbol, numeric=False),
    Column("incline (°)", lambda line: f"{line['incline_deg']:g}"),
    _STRIKES,
    Column("n", lambda line: str(line["n"])),
    Column("measured less model (mm, mm/s)", lambda line: fixed(1e3 * line["difference"], 2)),
    Column("u", lambda line: fixed(1e3 * line["u"], 2)),
    Column("Eₙ", lambda line: fixed(line["normalized_error"], 2)),
    Column("χ²", lambda line: fixed(line["chi2"], 2)),
    Column("p", _p),
)
_RODS: tuple[Column[Record], ...] = (
    Column("incline (°)", lambda line: f"{line['incline_deg']:g}"),
    _STRIKES,
    Column("rod", lambda line: "–".join(map(str, dict.fromkeys(line["rods"])))),
    Column("ΔV ± U (m/s)", lambda line: plus_minus(line["gain_m_s"])),
    Column("Eq. 9 (m/s)", lambda line: fixed(line["eq9_m_s"], 5)),
    Column("Eₙ", lambda line: fixed(line["normalized_error"], 2)),
)
_COMPARISON: tuple[Column[Record], ...] = (
    Column("quantity", lambda line: MEASURANDS[line["quantity"]].symbol, numeric=False),
    Column("χ²", lambda line: fixed(line["chi2"], 1)),
    Column("inclines", lambda line: str(line["degrees"])),
    Column("p", _p),
    Column("largest |Eₙ|", lambda line: fixed(
        max(abs(one["normalized_error"]) for one in line["inclines"]), 2)),
)  # fmt: skip

# In order; each is made by itself, and none where there is nothing to say.
_PARTS: dict[str, _Make] = {
    "Coefficients of the impacts": _coefficients,
    "Best single α": _single_alphas,
    "End correction": _end_correction,
    "Speed gained from each rod, measured and by Eq. 9": _impulses,
    "The protocol's model": _comparison,
    "Could not be worked out": _failed,
}
_PAGE_PARTS: dict[str, _Make] = {
    "The protocol's model, incline by incline": _incline_by_incline,
    "Single impulses": _single_impulses,
}
