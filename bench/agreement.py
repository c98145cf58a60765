"""Is a true model refuted as rarely as p says? Sessions of rigs that are off as they may be."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import groupby
from operator import attrgetter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.comparison import compare
from rig.analysis.session import analyze
from rig.analysis.summary import good_cases
from rig.bench.falls import Asked, falls, time_scale
from rig.commands.output import print_json, say, write_page
from rig.files import make_folder
from rig.measurands import MEASURANDS
from rig.protocol import reader
from rig.protocol.plan import runs as planned
from rig.text_table import text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterable, Iterator, Sequence

    from rig.analysis.comparison import Comparison
    from rig.bench.falls import SimulatedDrop
    from rig.clock.calibration import TimeScale
    from rig.protocol.protocol import Protocol

_REPEATS = "repeats: 12 "
_HEAD = """\
# Is a true model refuted as rarely as p says?

Written by `./run bench agreement`: simulated sessions whose falls follow Eqs. 8 to 13, on rigs that
are off by as much as their protocol states, β, μ and single impulses included. Over many sessions p
of χ² is uniform, and |Eₙ| is above 1 in 5 % of the lines. KS is the probability that p of a uniform
distribution would look less uniform than these (Kolmogorov and Smirnov)."""


@dataclass(slots=True)
class Comparisons:
    """What sessions said of the model, by measurand.

    Attributes
    ----------
    p
        Of χ² over all inclines, one a session.
    errors
        Eₙ of each incline, one list a session.
    """

    p: dict[str, list[float]] = field(default_factory=dict)
    errors: dict[str, list[list[float]]] = field(default_factory=dict)

    def lines(self, drops: int) -> Iterator[list[str]]:
        """One line of the table a measurand."""
        from scipy.stats import kstest  # noqa: PLC0415 - takes a second

        for name, values in self.p.items():
            p = np.array(values)
            beyond = np.abs(np.concatenate(self.errors[name])) > 1.0
            yield [
                MEASURANDS[name].symbol, str(drops), str(p.size),
                f"{kstest(p, 'uniform').pvalue:.2f}", f"{np.mean(p < 0.05):.0%}",
                f"{np.mean(p > 0.95):.0%}", f"{beyond.mean():.1%}",
            ]  # fmt: skip


def compare_sessions(protocol: Path, drops: int, seeds: Iterable[int]) -> Comparisons:
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
    text = protocol.read_text("utf-8")
    assert _REPEATS in text
    found, rigs = Comparisons(), [*seeds]
    with TemporaryDirectory() as folder:
        path = Path(folder) / protocol.name
        path.write_text(text.replace(_REPEATS, f"repeats: {drops} "), "utf-8")
        scene = reader.read(path)
        numbers = [run.number for run in planned(scene)]
        asked = Asked(f"sim://?stated=1&protocol={path}", rigs, [numbers] * len(rigs))
        for seed, session in groupby(falls([asked]), key=attrgetter("seed")):
            for one in _compared(scene, list(session), time_scale(seed)):
                errors = [line.normalized_error or 0.0 for line in one.differences]
                found.p.setdefault(one.quantity, []).append(one.p)
                found.errors.setdefault(one.quantity, []).append(errors)
    return found


def _compared(
    scene: Protocol, session: Sequence[SimulatedDrop], scale: TimeScale
) -> tuple[Comparison, ...]:
    analysis = analyze(scene, [fall.drop for fall in session], lambda _: scale)
    return compare(scene, good_cases(scene, analysis.runs))


def main(arguments: Namespace) -> int:
    """Compare sessions of each number of drops with the model; print a table."""
    rows: list[Sequence[str]] = [
        ["", "drops an incline", "sessions", "KS", "p < 0.05", "p > 0.95", "|Eₙ| > 1"]
    ]
    record: dict[str, Any] = {}
    for drops in arguments.drops:
        found = compare_sessions(Path(arguments.protocol), drops, range(1, arguments.sessions + 1))
        record[str(drops)] = {"p": found.p, "normalized_error": found.errors}
        rows += found.lines(drops)
        say(f"{drops} drops an incline: done")
        table = text_table(rows, left={0}, rule=True)
        if arguments.output:  # what is there when it is stopped
            write_page(make_folder(arguments.output), "agreement", _HEAD, table)
    if arguments.json:
        print_json(record)
    else:
        print("\n".join(table))
    return 0
