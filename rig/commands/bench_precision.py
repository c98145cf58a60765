"""``rig bench precision``."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import asdict, fields
from functools import partial
from itertools import groupby
from pathlib import Path

from rig.bench.figures import precision_figure
from rig.bench.precision import Cheapest, Gap, Point, Precision, as_json, precision
from rig.commands.output import print_found, say, write_study
from rig.files import make_folder, write_atomic
from rig.text_table import csv_text

_HEAD = """\
# Cheapest way to compute the model

`rig bench precision`: error against 50 digits, and run time, of every method and tolerance. Times
are of one machine: compare them with each other. Every point is in `precision.csv`."""


def main(arguments: Namespace) -> int:
    """Sweep, keep tables and pictures, print what is cheapest and what was left out."""
    folder = make_folder(arguments.output)
    study = precision(quick=arguments.quick, progress=say, keep=partial(_write, folder))
    print_found(as_json(study), lambda: summary(study), as_json=arguments.json)
    return 0


def summary(study: Precision) -> str:
    """The cheapest methods, how far the models are apart, and what was left out."""
    lines = []
    for name, title in study.scenes:
        lines.append(f"{title}: cheapest method for a relative error of Δz")
        rows: dict[str, list[Cheapest]] = {}
        for method in study.cheapest:
            if method.scene == name:
                rows.setdefault(_model(method), []).append(method)
        width = max(map(len, rows))
        for model, row in rows.items():
            for winner, won in groupby(row, key=_winner):
                targets = [f"{method.target:.0e}" for method in won]
                lines.append(f"  {model:<{width}}  {', '.join(targets)}: {winner}")
        lines += [
            f"  {_model(gap):<{width}}  less discrete: Δz {gap.separation_relative:+.2e}, "
            f"V {gap.speed_relative:+.2e}, gate {gap.gate_difference_s:+.2e} s"
            for gap in study.gaps
            if gap.scene == name
        ]
        omitted = sum(out.scene == name for out in study.left_out)
        lines.append(f"  left out: {omitted}, see precision.json")
    return "\n".join(lines)


def _model(of: Cheapest | Gap) -> str:
    return of.model if of.contact_time_s is None else f"{of.model} τ {of.contact_time_s:.0e} s"


def _winner(method: Cheapest) -> str:
    if method.median_s is None:
        return "none gets there"
    setting = f", {method.setting}" if method.contact_time_s is None else ""
    return f"{method.median_s * 1e6:.1f} µs, {method.method}{setting}"


def _write(folder: Path, study: Precision) -> None:
    """Write ``precision.csv``, ``precision.json`` and a picture for each scene so far."""
    columns = [field.name for field in fields(Point)]
    table = csv_text(columns, (asdict(point) for point in study.points))
    for name, title in study.scenes:
        points = [point for point in study.points if point.scene == name]
        write_atomic(folder / f"precision-{name}.svg", precision_figure(title, points))
    pictures = [f"![{title}](precision-{name}.svg)" for name, title in study.scenes]
    head, lines = "\n\n".join([_HEAD, *pictures]), summary(study).splitlines()
    write_study(folder, "precision", head, lines, as_json(study), table)
