"""What `rig estimate` finds, in words and tables, for the terminal and the page alike."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rig.report.columns import Column
from rig.report.numbers import decimals_for, fixed, plus_minus, value_of
from rig.report.parts import Part
from rig.report.table import aligned

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    Record = Mapping[str, Any]

SYMBOLS = {"alpha": "α", "restitution": "β", "friction": "μ", "pile_restitution": "β of the pile"}
_QUANTITIES = {"separation_m": "Δz", "speed_m_s": "V"}


def estimate_text(found: Mapping[str, Any]) -> str:
    """Write everything for a terminal."""
    lines = ["SIMULATED DATA"] if found.get("simulated") else []
    lines.append(f"{found['drops']} good drops, {found['edges']} edges")
    for part in parts(found):
        lines += ["", part.heading]
        lines += aligned(part.columns, part.records) if part.records else []
        lines += part.sentences
    return "\n".join(lines)


def parts(found: Mapping[str, Any]) -> Iterator[Part]:
    """Yield what there is to say, in order."""
    if found.get("parameters"):
        yield Part(
            "Coefficients of the impacts",
            _coefficient_words(found),
            _COEFFICIENTS,
            found["parameters"],
        )
    elif found.get("left_out"):
        words = [f"{left}." for left in found["left_out"]]
        yield Part("Coefficients of the impacts", words)
    if "alpha" in found:
        yield Part("Best single α", list(_tests(found)), _ALPHAS, _with_contact(found))
    if found.get("end_correction"):
        yield Part("End correction", [found["end_correction"]["sentence"]])
    if "impulses" in found:
        yield Part(
            "Speed gained from each rod, measured and by Eq. 9",
            [found["impulses"]["sentence"]],
            _IMPULSES,
            found["impulses"]["inclines"],
        )
    if found.get("comparison"):
        yield Part(
            "The protocol's model",
            ["Uncertainties of the rig and of the model's parameters are common to the inclines."],
            _COMPARISON,
            found["comparison"],
        )

    if found.get("failed"):
        failed = [f"{one['section']}: {one['why']}." for one in found["failed"]]
        yield Part("Could not be worked out", failed)


def page_parts(found: Mapping[str, Any]) -> Iterator[Part]:
    """Yield the same for a page, with a record for each rod too, or rods known by their sum."""
    yield from parts(found)
    inclines = [
        {"quantity": one["quantity"], **line}
        for one in found.get("comparison", ())
        for line in one["inclines"]
    ]
    if inclines:
        yield Part("The protocol's model, incline by incline", (), _INCLINES, inclines)
    rods = [
        {**line, **group}
        for line in found.get("impulses", {}).get("inclines", ())
        for group in line["groups"]
    ]
    if rods:
        heading = "Speed gained from each rod, from the bottom"
        yield Part("Single impulses", (), _RODS, rods, heading)


def _coefficient_words(found: Record) -> list[str]:
    words = [f"{left}." for left in found["left_out"]]
    names = found.get("correlation", {}).get("names", ())
    matrix = found.get("correlation", {}).get("matrix", ())
    pairs = [
        f"{_symbol(one)} and {_symbol(other)} {fixed(matrix[i][j], 2)}"
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
    elif "drag_per_m" in found:
        words.append("Air drag is not fitted: it takes a free chain, and rods that are all alike.")
    return words


def _symbol(name: str) -> str:
    """Write a coefficient as its symbol; of given α's each has its chain's name."""
    what, _, chain = name.partition(" ")
    return SYMBOLS[what] + (f" of {chain}" if chain else "")


def _tests(found: Record) -> Iterator[str]:
    tests = found["tests"]
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


_STRIKES = Column("strikes", lambda line: str(line.get("impact_chain", "")), numeric=False)
"""Which chain, where chains are unlike."""
_COEFFICIENTS = (
    Column("coefficient", lambda line: _symbol(line["name"]), numeric=False),
    Column("least squares ± U", lambda line: plus_minus(line["least_squares"])),
    Column("posterior, 95 %", _posterior),
    Column("protocol", _stated),
    Column("from", lambda line: "edges" if line["identified"] else "held", numeric=False),
)
_ALPHAS = (
    Column("incline (°)", lambda line: f"{line['incline_deg']:g}"),
    _STRIKES,
    Column("n", lambda line: str(line["n"])),
    Column("α ± U", lambda line: plus_minus(line["alpha"])),
    Column("α by coefficients", lambda line: fixed(value_of(line.get("model")), 5)),
    Column("contact point ± U (mm)", _contact),
)
_IMPULSES = (
    Column("incline (°)", lambda line: f"{line['incline_deg']:g}"),
    _STRIKES,
    Column("rods", lambda line: str(line["rods"])),
    Column("resolved", lambda line: str(line["resolved"])),
    Column("χ² of Eq. 9", lambda line: fixed(line["chi2"], 1)),
    Column("p", _p),
    Column("largest |Eₙ|", _worst),
)
_INCLINES = (
    Column("quantity", lambda line: _QUANTITIES[line["quantity"]], numeric=False),
    Column("incline (°)", lambda line: f"{line['incline_deg']:g}"),
    _STRIKES,
    Column("n", lambda line: str(line["n"])),
    Column("measured less model (mm, mm/s)", lambda line: fixed(1e3 * line["difference"], 2)),
    Column("u", lambda line: fixed(1e3 * line["u"], 2)),
    Column("Eₙ", lambda line: fixed(line["normalized_error"], 2)),
    Column("χ²", lambda line: fixed(line["chi2"], 2)),
    Column("p", _p),
)
_RODS = (
    Column("incline (°)", lambda line: f"{line['incline_deg']:g}"),
    _STRIKES,
    Column("rod", lambda line: "–".join(map(str, dict.fromkeys(line["rods"])))),
    Column("ΔV ± U (m/s)", lambda line: plus_minus(line["gain_m_s"])),
    Column("Eq. 9 (m/s)", lambda line: fixed(line["eq9_m_s"], 5)),
    Column("Eₙ", lambda line: fixed(line["normalized_error"], 2)),
)
_COMPARISON = (
    Column("quantity", lambda line: _QUANTITIES[line["quantity"]], numeric=False),
    Column("χ²", lambda line: fixed(line["chi2"], 1)),
    Column("inclines", lambda line: str(line["degrees"])),
    Column("p", _p),
    Column("largest |Eₙ|", lambda line: fixed(
        max(abs(one["normalized_error"]) for one in line["inclines"]), 2)),
)  # fmt: skip
