"""``rig bench link``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.bench.link import link
from rig.commands.output import print_json, say

if TYPE_CHECKING:
    from argparse import Namespace


def main(arguments: Namespace) -> int:
    """Measure the way from the port to a client."""
    found = link(say)
    if arguments.json:
        print_json(found)
        return 0
    for name, rate in found["edges_per_s"].items():
        print(f"{name.replace('_', ' '):<28}{rate:>12,.0f} edges/s")
    late, idle = found["latency_at_5000_per_s_s"], found["idle"]
    print(f"{'latency, median and p99':<28}{late['median'] * 1e3:>7.1f} {late['p99'] * 1e3:.1f} ms")
    print(f"{'idle daemon':<28}{idle['alone_cpu']:>12.1%} of a core")
    print(f"{'with one who watches':<28}{idle['watched_cpu']:>12.1%} of a core")
    print(f"{'memory':<28}{idle['memory_mb']:>12.0f} MB")
    return 0
