"""``rig design``."""

from __future__ import annotations

from dataclasses import replace
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from rig.analysis.components import stated
from rig.commands.output import print_found, say
from rig.design.cases import beams_of, cases, with_beams
from rig.design.forecast import GateLayout, forecast
from rig.design.rewriting import with_heights
from rig.design.search import better, readable, room
from rig.design.trials import trials, trials_text
from rig.errors import InputError
from rig.files import check_place, write_atomic
from rig.measurands import MEASURANDS
from rig.protocol import reader
from rig.protocol.measurable import check_measurable
from rig.report.columns import Column, aligned
from rig.report.estimate import symbol
from rig.report.numbers import decimals_for, fixed
from rig.units import Dimension, UnitError, parse

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Mapping, Sequence

    from rig.analysis.components import Components
    from rig.design.forecast import Forecast
    from rig.protocol.protocol import Protocol, Side

SPACING_M = 0.01


def main(arguments: Namespace) -> int:
    """Predict the uncertainties of a layout, and search for a better layout."""
    if arguments.output and arguments.no_search:
        raise InputError("-o needs a proposal; leave --no-search out")
    if arguments.output:
        check_place(arguments.output)
    protocol = reader.read(arguments.protocol)
    check_measurable(protocol)
    there = beams_of(protocol)
    if arguments.repeats is not None:
        protocol = replace(protocol, plan=replace(protocol.plan, repeats=arguments.repeats))
    components = stated(protocol) if arguments.learned is None else _learned(arguments.learned)
    limits = room(
        protocol,
        _length("--lowest", arguments.lowest),
        _length("--highest", arguments.highest),
        _length("--spacing", arguments.spacing) or SPACING_M,
    )
    if limits.lowest > limits.highest:
        raise InputError(
            "--lowest is above --highest", "the highest beam is below the start of the drop"
        )
    found: dict[str, Any] = {
        "runs": len(protocol.plan.inclines) * protocol.plan.repeats,
        "scatter": "stated" if arguments.learned is None else "learned",
        "current": _said(protocol, there, components),
    }
    if not arguments.no_search:
        proposed = better(protocol, components, limits, say)
        found["proposed"] = _said(protocol, proposed, components)
        if arguments.output:
            write_atomic(arguments.output, with_heights(protocol, proposed))
            say(f"protocol: {arguments.output}")
    print_found(found, lambda: design_text(found), as_json=arguments.json)
    return 0


def _learned(path: str) -> Components:
    """Return the scatter of an earlier session of the same rig."""
    from rig.results import detailed  # noqa: PLC0415 - only with --learned
    from rig.session.store import Session  # noqa: PLC0415

    with Session.open(path, readonly=True) as session:
        joint = detailed(session)[0].joint
    if joint is None:
        raise InputError(f"{path}: too few good drops for a scatter", "leave out --learned")
    return joint.components


def _length(option: str, text: str | None) -> float | None:
    if text is None:
        return None
    try:
        value = parse(text, Dimension.LENGTH).value
    except UnitError as error:
        raise InputError(f"{option}: {error}") from None
    if value <= 0.0:
        raise InputError(f"{option}: found {text}; accepted: a length above 0")
    return value


def _said(
    protocol: Protocol, beams: Sequence[tuple[Side, float]], components: Components
) -> dict[str, Any]:
    assert protocol.gates is not None
    layout = GateLayout.of(cases(protocol, beams, components), range(len(beams)))
    expected: Forecast = forecast(protocol, layout, sure=True)
    outcome = trials(with_beams(protocol, beams))
    text = trials_text(outcome, protocol.vocabulary)
    return {
        "gates": [
            {"channel": gate.channel, "side": side, "height_m": height}
            for gate, (side, height) in zip(protocol.gates.gates, beams, strict=True)
        ],
        "readable": readable(protocol, beams),
        "trials": {"drops": outcome.drops, "read": outcome.read, "text": text},
        "measurands": [
            {
                "name": name,
                "u_run": expected.typical(name),
                "inclines": [
                    {**at.json(), "u_run": u, "u_mean": expected.mean[name][at]}
                    for at, u in single.items()
                ],
            }
            for name, single in expected.single.items()
        ],
        "coefficients": [
            {"name": name, "u": u, "identified": name not in expected.held}
            for name, u in expected.coefficients.items()
        ],
    }


def design_text(found: Mapping[str, Any]) -> str:
    """Write layouts and their uncertainties, for a terminal."""
    layouts = [name for name in ("current", "proposed") if name in found]
    lines = [
        f"expected standard uncertainties of {found['runs']} runs, with the {found['scatter']} "
        "scatter",
        "",
        *aligned(
            [
                Column("quantity", itemgetter("what"), numeric=False),
                *(Column(name, itemgetter(name)) for name in layouts),
            ],
            _records(found, layouts),
        ),
    ]
    for name in layouts:
        lines.append("")
        heights: dict[str, list[str]] = {}
        for gate in found[name]["gates"]:
            heights.setdefault(gate["side"], []).append(f"{gate['height_m'] * 1e3:g}")
        for side, millimetres in heights.items():
            where = f", {side} side" if len(heights) > 1 else ""
            lines.append(f"{name}{where} (mm): {', '.join(millimetres)}")
        lines.append(f"{name}: {found[name]['trials']['text']}")
        if not found[name]["readable"]:
            lines.append(
                f"{name}: drops may be void, because edges are ambiguous; "
                "add a beam above the drop height"
            )
    return "\n".join(lines)


def _records(found: Mapping[str, Any], layouts: list[str]) -> list[dict[str, str]]:
    rows: dict[str, dict[str, str]] = {}
    for layout in layouts:
        for line in found[layout]["measurands"]:
            quantity = MEASURANDS[line["name"]]
            if quantity.told:
                what = f"{quantity.symbol} of one run ({quantity.fine})"
                row = rows.setdefault(what, {"what": what})
                row[layout] = _plain(line["u_run"] * quantity.fine_scale)
        for line in found[layout]["coefficients"]:
            row = rows.setdefault(line["name"], {"what": symbol(line["name"])})
            row[layout] = _plain(line["u"]) if line["identified"] else "not identified"
    return list(rows.values())


def _plain(uncertainty: float) -> str:
    return fixed(uncertainty, decimals_for(uncertainty))
