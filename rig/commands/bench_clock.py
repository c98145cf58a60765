"""``rig bench clock``."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

from rig.bench.clock import DURATIONS_S, clock
from rig.commands.output import print_json, say

if TYPE_CHECKING:
    from argparse import Namespace


def main(arguments: Namespace) -> int:
    """Print errors of the tick rate against the time clocks were compared for."""
    rows = clock(arguments.protocol, arguments.seeds, say, DURATIONS_S)
    if arguments.json:
        print_json({"rows": [asdict(row) for row in rows]})
        return 0
    print(f"{'after':>7}  {'by':<9}  {'rms':>9}  {'worst':>9}  {'stated u':>9}  within 1.96 u")
    for row in rows:
        errors = "  ".join(f"{ppm:>5.2g} ppm" for ppm in (row.rms, row.worst, row.u))
        print(f"{row.duration_s:>5.0f} s  {row.source:<9}  {errors}  {row.held:>13.0%}")
    return 0
