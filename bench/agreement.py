"""Is a true model refuted as rarely as p says? Sessions of rigs that are off as they may be."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bench.studies.sessions import with_repeats, without_device
from bench.workers import results
from rig.analysis.comparison import compare
from rig.analysis.summary import good_cases
from rig.bench.falls import Asked, simulation
from rig.bench.findings import Findings
from rig.commands.output import progress
from rig.measurands import MEASURANDS
from rig.protocol import reader
from rig.protocol.plan import runs as planned
from rig.text_table import text_table
from rig.threads import one_thread

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator, Sequence

_SEEDS = 1000  # apart: no rig has sessions of two lengths
_CHUNK = 5  # sessions for one process of the simulation
_HEAD = """\
# Is a true model refuted as rarely as p says?

`./run bench agreement`: simulated sessions by Eqs. 8 to 13, on rigs as wrong as their protocol
states. p of χ² should be uniform (*KS*: Kolmogorov and Smirnov), and |Eₙ| above 1 in at most 5 %. ±
is from rig to rig."""


class SessionAgreement(NamedTuple):
    """What a simulated session said of the model that made it.

    Attributes
    ----------
    quantity
        Its name in JSON.
    drops, seed
        Drops at each incline; seed of the rig.
    chi2, degrees, p
        Over all inclines.
    normalized_errors
        Eₙ of each incline.
    """

    quantity: str
    drops: int
    seed: int
    chi2: float
    degrees: int
    p: float
    normalized_errors: tuple[float, ...]

    def row(self) -> dict[str, Any]:
        """Return a line of the table of sessions."""
        errors = " ".join(f"{error:.3f}" for error in self.normalized_errors)
        figures = {"chi2": f"{self.chi2:.4f}", "p": f"{self.p:.6f}", "normalized_errors": errors}
        return self._asdict() | figures


@one_thread
def compare_sessions(protocol: Path, drops: int, seeds: Sequence[int]) -> list[SessionAgreement]:
    """Compare a session of each rig with the model.

    Parameters
    ----------
    protocol
        A ready one, with twelve drops at each incline.
    drops
        How many there are to be at each.
    seeds
        Of the rigs.
    """
    with TemporaryDirectory() as folder:
        path = with_repeats(str(protocol), drops, Path(folder))
        scene = reader.read(path)
        numbers = [run.number for run in planned(scene)]
        asked = Asked(simulation(path, url="sim://?stated=1"), seeds, [numbers] * len(seeds))
        sessions = zip(seeds, without_device([(scene, asked)]), strict=True)
        return [
            SessionAgreement(
                comparison.quantity, drops, seed, comparison.chi2, comparison.degrees, comparison.p,
                tuple(line.normalized_error or 0.0 for line in comparison.differences),
            )
            for seed, session in sessions
            for comparison in compare(scene, good_cases(scene, session.analysis.runs))
        ]  # fmt: skip


def summarize(agreements: Sequence[SessionAgreement]) -> Iterator[dict[str, Any]]:
    """Yield the counts of each measurand and number of drops."""
    from scipy.stats import kstest  # noqa: PLC0415 - takes a second

    cases = defaultdict(list)
    for agreement in agreements:
        cases[agreement.quantity, agreement.drops].append(agreement)
    for quantity, drops in sorted(cases):
        sessions = cases[quantity, drops]
        p = np.array([session.p for session in sessions])
        beyond = [np.mean(np.abs(session.normalized_errors) > 1.0) for session in sessions]
        yield {
            "quantity": quantity,
            "drops": drops,
            "sessions": p.size,
            "ks_p": float(kstest(p, "uniform").pvalue),
            **{f"p_below_{level}": float(np.mean(p < level)) for level in (0.01, 0.05, 0.5)},
            "p_above_0.95": float(np.mean(p > 0.95)),
            "beyond": float(np.mean(beyond)),
            "beyond_se": float(np.std(beyond) / np.sqrt(p.size)),
        }


def _table(agreements: Sequence[SessionAgreement]) -> list[str]:
    rows: list[Sequence[str]] = [
        ["", "drops an incline", "sessions", "KS", "p < 0.01", "p < 0.05", "p < 0.5", "p > 0.95",
         "|Eₙ| > 1", ""]
    ]  # fmt: skip
    rows += [
        [
            MEASURANDS[line["quantity"]].symbol, str(line["drops"]), str(line["sessions"]),
            f"{line['ks_p']:.2f}", f"{line['p_below_0.01']:.0%}", f"{line['p_below_0.05']:.0%}",
            f"{line['p_below_0.5']:.0%}", f"{line['p_above_0.95']:.0%}", f"{line['beyond']:.1%}",
            f"± {line['beyond_se']:.1%}",
        ]
        for line in summarize(agreements)
    ]  # fmt: skip
    return text_table(rows, left={0}, rule=True)


def run(arguments: Namespace) -> Iterator[Findings]:
    """Compare sessions of each number of drops with the model."""
    calls: list[tuple[Any, ...]] = []
    for drops in arguments.drops:
        seeds = range(drops * _SEEDS + 1, drops * _SEEDS + arguments.sessions + 1)
        parts = [seeds[n : n + _CHUNK] for n in range(0, len(seeds), _CHUNK)]
        calls += [(compare_sessions, Path(arguments.protocol), drops, part) for part in parts]
    agreements: list[SessionAgreement] = []
    for done, part in enumerate(results(calls, arguments.jobs), 1):
        agreements += part
        progress(done * _CHUNK, len(calls) * _CHUNK, "sessions")
        yield _findings(agreements)


def _findings(agreements: list[SessionAgreement]) -> Findings:
    agreements.sort(key=lambda session: (session.quantity, session.drops, session.seed))
    rows = [agreement.row() for agreement in agreements]
    return Findings({"agreement": [*summarize(agreements)]}, _table(agreements), _HEAD, rows)
