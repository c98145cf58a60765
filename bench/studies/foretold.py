"""What ``rig design`` foretells of a layout, beside what a session on it then states."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from bench.studies.accuracy import repeated
from rig.analysis.components import stated
from rig.analysis.joint_fit import FEWEST
from rig.analysis.result import GOOD
from rig.design.cases import beams_of, cases
from rig.design.forecast import GateLayout, forecast
from rig.errors import InputError
from rig.estimate.session import estimate
from rig.measurands import MEASURANDS
from rig.protocol.reader import read
from rig.ready import ready_protocol
from rig.results import detailed, protocol_of
from rig.runner import Operator, run_protocol
from rig.session.store import Session

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rig.analysis.components import Components
    from rig.analysis.session import Analysis
    from rig.protocol.protocol import Protocol

PROTOCOLS = (
    "inclined-uniform", "inclined-uniform-uno", "graded-chain", "graded-chain-uno", "single-chain",
)  # fmt: skip
_PORT = "sim://"
_SPARE = 2  # times as many as learning needs: some are void


@dataclass(frozen=True, slots=True)
class Foretold:
    """One standard uncertainty, before a session and after it.

    Attributes
    ----------
    protocol, quantity
        Which ready file; JSON name of a measurand, or a coefficient's.
    runs
        Good ones.
    by_stated, by_learned
        Foretold with the scatter that the protocol states, and with what the session taught.
    found
        What the session states: of a measurand in one run (root mean square), of a coefficient by
        least squares on its edges.
    """

    protocol: str
    quantity: str
    runs: int
    by_stated: float
    by_learned: float
    found: float

    def json(self) -> dict[str, Any]:
        """Itself as plain data, SI units."""
        return asdict(self)


def foretold(
    names: Sequence[str], repeats: int, seed: int, say: Callable[[str], None]
) -> list[Foretold]:
    """Simulate a session of each protocol and compare.

    Parameters
    ----------
    names
        Of ready protocols in which something strikes.
    repeats
        Drops at each incline; of few inclines more, for of fewer than `FEWEST` in all nothing is
        learned.
    seed
        Of the simulation.
    say
        Told how far it is.

    Raises
    ------
    InputError
        Too few good drops to learn from.
    """
    found: list[Foretold] = []
    for name in names:
        say(f"{name}: simulating the session")
        with TemporaryDirectory() as folder:
            path = Path(folder) / "session"
            ready = ready_protocol(name)
            inclines = len(read(ready).plan.inclines)
            each = max(repeats, math.ceil(_SPARE * FEWEST / inclines))
            source = repeated(str(ready), each, Path(folder))
            run_protocol(source, _PORT, str(path), Operator(lambda _: None), seed)
            with Session.open(path, readonly=True) as session:
                protocol = protocol_of(session)
                analysis, _ = detailed(session)
        found += _compared(name, protocol, analysis)
    return found


def _compared(name: str, protocol: Protocol, analysis: Analysis) -> list[Foretold]:
    if analysis.joint is None:
        raise InputError(f"{name}: too few good drops to learn from", "take more repeats")
    good = [one for one in analysis.runs if one.verdict in GOOD]
    before = _forecast(protocol, stated(protocol))
    after = _forecast(protocol, analysis.joint.components)
    stands = {
        quantity: math.sqrt(sum(u * u for u in us) / len(us))
        for quantity in before
        if quantity in MEASURANDS
        and (us := [one.quantities[quantity].u for one in good if quantity in one.quantities])
    }
    coefficients = estimate(protocol, analysis).coefficients
    if coefficients is not None:
        stands |= {one.name: one.least_squares.u for one in coefficients.parameters
                   if one.identified}  # fmt: skip
    return [
        Foretold(name, quantity, len(good), before[quantity], after[quantity], u)
        for quantity, u in stands.items()
        if quantity in before and quantity in after
    ]


def _forecast(protocol: Protocol, components: Components) -> dict[str, float]:
    beams = beams_of(protocol)
    layout = GateLayout.of(cases(protocol, beams, components), range(len(beams)))
    found = forecast(protocol, layout, sure=True)
    return found.wanted()
