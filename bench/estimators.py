"""``./run bench estimators``."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from bench.studies.estimators import as_json, estimators
from bench.studies.figures import estimators_figure
from rig.commands.output import leave_study, say
from rig.files import make_folder
from rig.report.columns import Column, aligned
from rig.text_table import csv_text

if TYPE_CHECKING:
    from argparse import Namespace

_COLUMNS: tuple[Column[dict[str, Any]], ...] = (
    Column("estimator", lambda one: one["name"], numeric=False),
    Column("M", lambda one: f"{one['trials']:.0e}" if one["trials"] else ""),
    Column("runs", lambda one: str(one["runs"])),
    Column("ms per run", lambda one: f"{1e3 * one['seconds']:.3g}" if one["seconds"] else ""),
    Column("Δz rms (mm)", lambda one: f"{1e3 * one['separation_rms_m']:.3f}"),
    Column("median", lambda one: f"{1e3 * one['separation_median_m']:.3f}"),
    Column("V rms (mm/s)", lambda one: f"{1e3 * one['speed_rms_m_s']:.2f}"),
    Column("median", lambda one: f"{1e3 * one['speed_median_m_s']:.2f}"),
)  # fmt: skip

_HEAD = """\
# Error against time of each method

`./run bench estimators`: the same simulated drops read by each method, compared with the true
values. Times are of one machine: compare them with each other.

![Error against time](estimators.svg)"""


def main(arguments: Namespace) -> int:
    """Measure every estimator on the same drops."""
    folder = make_folder(arguments.output)
    found, left_out, times = estimators(
        arguments.protocol,
        arguments.port,
        arguments.seed,
        arguments.repeats,
        arguments.budget,
        say,
    )
    whole = as_json(found, left_out, times)
    lines = whole["estimators"]
    said = [*aligned(_COLUMNS, lines), *(f"left out: {one}" for one in left_out)]
    said += [f"{name}: {ratio:.1f} times numpy.linalg.lstsq" for name, ratio in times.items()]
    leave_study(
        folder, "estimators", _HEAD, said, whole, csv_text(asdict(found[0]), lines),
        estimators_figure(lines), as_json=arguments.json,
    )  # fmt: skip
    return 0
