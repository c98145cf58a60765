"""Drops straight from the simulated lab: what a perfect recorder would keep, and the truth."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from rig.analysis.chain_records import ChainRecord, chain_records
from rig.analysis.components import Components
from rig.analysis.drop import DropCase
from rig.analysis.drop_model import DropModel
from rig.analysis.fit import Fit, match
from rig.analysis.identify import Identification, identify
from rig.analysis.result import Audit, DropResult, Measured, Verdict
from rig.clock.calibration import TimeScale
from rig.link.messages import pack_label
from rig.model.chain import Chain
from rig.protocol import reader
from rig.protocol.protocol import Protocol, Run
from rig.records import Drop, Edge
from rig.threads import one_thread
from sim.dials import Dials
from sim.lab import ChainLab
from sim.truth import Truth

PROTOCOLS = Path(__file__).parents[2] / "protocols"
UNIFORM, GRADED, SINGLE, FENCE = (
    reader.read(PROTOCOLS / f"{name}.yaml")
    for name in ("inclined-uniform", "graded-chain", "single-chain", "picket-fence")
)
SCENES = {"uniform": UNIFORM, "graded": GRADED, "single": SINGLE, "fence": FENCE}

STATED = Components()
HZ = 16_000_000
CLOCK_U = 1e-6  # what a minute of pings gives
STRAY = -1


def codes(result: DropResult) -> list[str]:
    """What a drop's reasons are."""
    return [reason.code for reason in result.reasons]


def made_up(run: Run, verdict: Verdict = "accepted", **quantities: Measured) -> DropResult:
    """Results of a drop that nobody let go."""
    return DropResult(run, 1, verdict, (), Audit(660, 660), quantities)


def with_dials(**changes: float) -> Dials:
    """Nothing disturbed but what is named."""
    return Dials(**(asdict(Dials.quiet()) | changes))


@dataclass(frozen=True)
class Case:
    protocol: Protocol
    run: Run
    drop: Drop
    truth: Truth
    scale: TimeScale

    def read(self, explain: bool = True) -> tuple[DropResult, Fit | None]:
        return DropCase(self.protocol, self.run, self.drop, self.scale).read(explain=explain)

    def analyze(self) -> DropResult:
        return self.read()[0]

    def judge(self) -> DropResult:
        """The same, but what else would explain a void drop is not sought: that takes longest."""
        return self.read(explain=False)[0]

    def with_edges(self, edges) -> Case:
        """The same drop with other edges; they need not be in order of time."""
        ordered = tuple(sorted(edges, key=lambda edge: edge.tick))
        return replace(self, drop=replace(self.drop, edges=ordered))

    def side(self, role: str) -> ChainRecord:
        """One chain with the edges of its gates."""
        hung = chain_records(self.protocol, self.run, self.drop, self.scale.hz)
        record = next(record for record in hung if record.role == role)
        ratios = impact_ratios(record.chain.chain) if role == "impact" else None
        return replace(record, ratios=ratios, alpha=0.0)

    @property
    def records(self) -> list[ChainRecord]:
        names = {"impact": self.run.impact, "free": self.run.free}
        return [self.side(role) for role, name in names.items() if name is not None]

    @one_thread
    def identify(self) -> Identification:
        """The best reading of the edges."""
        return identify(self.protocol, self.records, self.scale.u)

    def model(self) -> tuple[DropModel, dict, np.ndarray]:
        """The observation equations of this drop, its fall, and the matches that it gives."""
        fit = self.identify().fit_reading()
        x, at = np.zeros(fit.x.size), fit.model.unknowns
        for name in ("impact release", "free release", "alpha", "clock", "drag", "drop"):
            if name in at:
                x[at[name]] = fit.x[at[name]]
        model = DropModel(self.protocol, self.records, self.scale.u, alpha=fit.model.alpha)
        return model, match(model, x), x


def impact_ratios(chain: Chain) -> np.ndarray:
    """ΔV/V of each impact for α = 1: m/(M + γm) of Eq. 9, γ by Eq. 10 for rods all alike."""
    xi = chain.inertia
    gamma = (1 + xi) * (1 + 1 / xi) / 4
    above = [sum(chain.masses[k + 1 :]) for k in range(chain.rods)]
    return np.array(
        [m / (M + gamma * m) if M else 0.0 for m, M in zip(chain.masses, above, strict=True)]
    )


def first_run(protocol: Protocol, incline: float | None) -> int:
    """The first run at an incline; of all runs where nothing is inclined."""
    lab = ChainLab(protocol, Dials.quiet(), 0)
    return next(n for n, run in lab.runs.items() if incline is None or run.incline_deg == incline)


def case(
    protocol: Protocol,
    dials: Dials | None = None,
    *,
    incline: float | None = None,
    seed: int = 1,
    run: int | None = None,
    attempt: int = 1,
    hz: int = HZ,
    clock_u: float = CLOCK_U,
) -> Case:
    """One simulated drop, with a calibrated clock unless the dials say otherwise."""
    dials = Dials() if dials is None else dials
    told: list[Truth] = []
    lab = ChainLab(protocol, dials, seed, told.append)
    number = first_run(protocol, incline) if run is None else run
    rate = hz * (1.0 + dials.clock)
    edges = tuple(
        Edge(round(seconds * rate), channel, blocked)
        for seconds, channel, blocked in lab.drop(pack_label(number, attempt))
    )
    drop = Drop(number, attempt, hz, edges)
    return Case(protocol, lab.runs[number], drop, told[0], TimeScale(rate, clock_u))


def assert_true(
    result: DropResult, truth: Truth, most: float = 1.0, names: Iterable[str] = ()
) -> None:
    """See that measurands, all or some, are what they really were: within so many of their U."""
    for name in names or result.quantities:
        measured = result.quantities[name]
        assert abs(measured.value - getattr(truth, name)) < most * measured.expanded, name


def wrong_rods(result: DropResult, truth: Truth) -> list[int]:
    """Edges that were given to another rod than the one they came from."""
    origins = {number: truth.edges[number][3] for number in result.matches}
    return [n for n, rod in result.matches.items() if origins[n] not in (STRAY, rod)]
