"""``./run bench bulk``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bench.studies.bulk import bulk
from rig.commands.output import print_found, say

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Mapping


def main(arguments: Namespace) -> int:
    """Print how long falls take, as ratios."""
    found = bulk(arguments.falls, arguments.rounds, say)
    print_found(found, lambda: "\n".join(_table(found)), as_json=arguments.json)
    return 0


def _table(found: Mapping[str, Any]) -> list[str]:
    rods = found["rods"]
    lines = [
        f"{rods} rods, batches of {found['falls']} falls; median of {found['rounds']} rounds, "
        "least to most",
        _line(f"one fall over {rods} square roots", found["single_over_roots"], "×"),
        _line("falls of a batch, million/s", found["falls_per_s"], "", 1e-6),
        _line("one fall over one of a batch", found["single_over_batch"], "×"),
    ]
    if "batch_over_c" in found:
        lines.append(_line("batch over a C loop", found["batch_over_c"], "×"))
        lines[-1] += f"   {found['compiler']}"
    if "solver_over_single" in found:
        solver = found["solver"]
        lines.append(_line("solve_ivp over one fall", found["solver_over_single"], "×"))
        lines[-1] += (
            f"   rtol {solver['rtol']:g}: error {solver['error']:.0e}, "
            f"of one fall {solver['single_error']:.0e}"
        )
    return lines


def _line(label: str, spread: Mapping[str, float], unit: str, scale: float = 1.0) -> str:
    median, least, most = (spread[key] * scale for key in ("median", "least", "most"))
    return f"{label:<32}{f'{median:.4g}{unit}':>9}   {least:.4g} to {most:.4g}"
