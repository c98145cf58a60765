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
    print("latency at 5000 edges/s, median and p99")
    for name, late in found["latency_at_5000_per_s_s"].items():
        median, p99 = late["median"] * 1e3, late["p99"] * 1e3
        print(f"{name.replace('_', ' '):<28}{median:>7.1f} {p99:.1f} ms")
    idle = found["idle"]
    print(f"{'idle daemon':<28}{idle['alone_cpu']:>12.1%} of a core")
    print(f"{'with one who watches':<28}{idle['watched_cpu']:>12.1%} of a core")
    print(f"{'memory, idle':<28}{idle['memory_mb']:>12.0f} MB")
    print(f"{'memory, most in a flood':<28}{found['busy']['memory_mb']:>12.0f} MB")
    print(f"{'load of the machine':<28}{found['load']:>12.1f} on {found['cores']} cores")
    return 0
