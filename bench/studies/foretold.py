"""What ``rig design`` foretells of a layout, beside what a session on it then states."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from bench.studies.columns import Column, aligned
from bench.studies.sessions import with_device
from rig.analysis.components import stated
from rig.analysis.joint_fit import FEWEST
from rig.analysis.result import GOOD
from rig.bench.findings import Findings
from rig.commands.output import say
from rig.design.cases import cases
from rig.design.forecast import GateLayout, forecast
from rig.errors import InputError
from rig.estimate.session import estimate
from rig.measurands import MEASURANDS
from rig.protocol.reader import read
from rig.ready import ready_protocol
from rig.report.estimate import symbol

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator

    from rig.analysis.components import Components
    from rig.analysis.session import Analysis
    from rig.protocol.protocol import Protocol

PROTOCOLS = (
    "inclined-uniform", "inclined-uniform-uno", "graded-chain", "graded-chain-uno", "single-chain",
)  # fmt: skip
_SPARE = 2  # times as many as learning needs: some are void
_HEAD = """\
# Does a session reach the u that was predicted?

`./run bench foretold`: u of one run by `rig design`, from the stated and from the learned
scatter, beside u of a simulated session. The last column is session over prediction from the
learned scatter; 1 is agreement."""


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


def run(arguments: Namespace) -> Iterator[Findings]:
    """Simulate a session of each protocol and compare; of few inclines with more drops each.

    Of fewer than `FEWEST` drops in all nothing is learned.
    """
    forecasts: list[Foretold] = []
    chosen = [name for name in PROTOCOLS if (arguments.only or "") in name]
    for name in chosen or PROTOCOLS:
        say(f"{name}: simulating the session")
        ready = ready_protocol(name)
        least = math.ceil(_SPARE * FEWEST / len(read(ready).plan.inclines))
        repeats = max(arguments.repeats, least)
        session = with_device(str(ready), "sim://", arguments.seed, repeats)
        forecasts += _compared(name, session.protocol, session.analysis)
    rows = [asdict(each) for each in forecasts]
    yield Findings({"foretold": rows}, aligned(_COLUMNS, forecasts), _HEAD, rows, simulated=True)


def _compared(name: str, protocol: Protocol, analysis: Analysis) -> list[Foretold]:
    if analysis.joint is None:
        raise InputError(f"{name}: too few good drops to learn from", "take more repeats")
    good = [result for result in analysis.runs if result.verdict in GOOD]
    before = _forecast(protocol, stated(protocol))
    after = _forecast(protocol, analysis.joint.components)
    stands = {
        quantity: math.sqrt(sum(u * u for u in us) / len(us))
        for quantity in before
        if quantity in MEASURANDS
        and (us := [run.quantities[quantity].u for run in good if quantity in run.quantities])
    }
    coefficients = estimate(protocol, analysis).coefficients
    if coefficients is not None:
        stands |= {each.name: each.least_squares.u for each in coefficients.parameters
                   if each.identified}  # fmt: skip
    return [
        Foretold(name, quantity, len(good), before[quantity], after[quantity], u)
        for quantity, u in stands.items()
        if quantity in before and quantity in after
    ]


def _forecast(protocol: Protocol, components: Components) -> dict[str, float]:
    return forecast(protocol, GateLayout.of(cases(protocol, components))).goals()


def _words(each: Foretold) -> str:
    row = MEASURANDS.get(each.quantity)
    return symbol(each.quantity) if row is None else f"u of {row.symbol}, one run ({row.fine})"


def _size(each: Foretold, u: float) -> str:
    row = MEASURANDS.get(each.quantity)
    return f"{u * (1.0 if row is None else row.fine_scale):.3g}"


_COLUMNS: tuple[Column[Foretold], ...] = (
    Column("protocol", lambda each: each.protocol, numeric=False),
    Column("quantity", _words, numeric=False),
    Column("runs", lambda each: str(each.runs)),
    Column("foretold by what is stated", lambda each: _size(each, each.by_stated)),
    Column("by what was learned", lambda each: _size(each, each.by_learned)),
    Column("found", lambda each: _size(each, each.found)),
    Column("found / foretold", lambda each: f"{each.found / each.by_learned:.2f}"),
)
