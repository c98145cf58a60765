"""``rig design``."""

from dataclasses import replace
from typing import Any

from rig.analysis.components import Components, priors
from rig.commands.output import Arguments, print_data, say
from rig.design.cases import cases
from rig.design.forecast import GateLayout, forecast
from rig.design.rewriting import rewrite_heights
from rig.design.search import better, room
from rig.design.trials import readable, trials
from rig.files import write_atomic
from rig.plain_data import attributes
from rig.protocol import reader
from rig.protocol.measurable import check_measurable
from rig.protocol.protocol import Protocol
from rig.reasons import rig_error
from rig.report.design import design_lines
from rig.report.templates import sentence


def main(arguments: Arguments) -> None:
    """Predict the uncertainties of a layout, and search for a better layout."""
    protocol = reader.read(arguments.protocol)
    check_measurable(protocol)
    if arguments.repeats is not None:
        protocol = replace(protocol, plan=replace(protocol.plan, repeats=arguments.repeats))
    learned = arguments.learned
    components = _read_scatter(learned, protocol) if learned else priors(protocol)
    limits = room(protocol, arguments.lowest, arguments.highest, arguments.spacing)
    if limits.lowest > limits.highest:
        raise rig_error("beams_reversed")
    layouts = {
        "runs": len(protocol.runs()),
        "scatter": "learned" if learned else "stated",
        "current": _forecast(protocol, components),
    }
    if not arguments.no_search:
        proposed = better(protocol, components, limits, say)
        layouts["proposed"] = _forecast(proposed, components)
        if arguments.output:
            write_atomic(arguments.output, rewrite_heights(proposed))
            say(f"protocol: {arguments.output}")
    print_data(layouts, design_lines(layouts), as_json=arguments.json)


def _read_scatter(path: str, protocol: Protocol) -> Components:
    """Return the scatter of an earlier session of the same rig."""
    from rig.results.whole import complete_analysis, protocol_of  # noqa: PLC0415 - only with --learned
    from rig.session.store import Session  # noqa: PLC0415

    with Session.open(path, readonly=True) as session:
        if bool(protocol_of(session).surface) != bool(protocol.surface):
            raise rig_error("scatter_unlike", path=path, protocol=protocol.title)
        joint = complete_analysis(session).joint
    if joint is None:
        raise rig_error("scatter_unknown", path=path)
    return joint.components


def _forecast(protocol: Protocol, components: Components) -> dict[str, Any]:
    """Return what a layout measures, and how well, as JSON has it."""
    expected = forecast(protocol, GateLayout.of(cases(protocol, components)))
    outcome, gates = trials(protocol), protocol.gates.gates
    words = sentence("trials", outcome, protocol.vocabulary)
    return {
        "gates": [attributes(gate, "channel", "side", "height_m=height") for gate in gates],
        "readable": readable(protocol),
        "trials": {"drops": outcome.drops, "read": outcome.read, "text": words},
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
