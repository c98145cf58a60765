"""``rig bench tui``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.bench.tui import RATE, tui
from rig.commands.output import print_json, say

if TYPE_CHECKING:
    from argparse import Namespace


def main(arguments: Namespace) -> int:
    """Measure what the screen costs."""
    found = tui(arguments.protocol, say)
    if arguments.json:
        print_json(found)
        return 0
    first, lag = found["first_paint"], found["lag_s"]
    print(
        f"{'first paint':<28}{first['wall_s']:>7.2f} s, of which {first['cpu_s']:.2f} s computing"
    )
    print(f"{'quiet screen':<28}{found['quiet_cpu']:>8.1%} of a core")
    print(f"{f'{RATE:.0f} edges a second':<28}{found['live_cpu']:>8.1%} of a core")
    print(f"{'frames a second':<28}{found['frames_per_s']:>7.1f}")
    print(f"{'one frame':<28}{found['cpu_per_frame_s'] * 1e3:>7.1f} ms computing")
    print(f"{'lag, median and p99':<28}{lag['median'] * 1e3:>7.0f} {lag['p99'] * 1e3:.0f} ms")
    return 0
