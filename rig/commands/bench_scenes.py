"""``rig bench scenes``."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Sequence
from dataclasses import astuple
from pathlib import Path

from rig.bench.scenes import Cost, Quartiles, as_json, scenes
from rig.commands.output import print_found, say, write_study
from rig.files import make_folder
from rig.text_table import csv_text, text_table

_HEAD = """\
# What each scene costs

`rig bench scenes`: what a scene does not have is neither loaded nor computed. Counts are
reproducible; times are of one machine, so compare their ratios.

![Costs of scenes](scenes.svg)"""


def main(arguments: Namespace) -> int:
    """Measure every scene, keep the table, print it."""
    folder = None if arguments.output is None else make_folder(arguments.output)
    ready = sorted(Path(arguments.protocols).glob("*.yaml"))
    if not ready:
        say(f"no protocols in {arguments.protocols}: left out the ready ones")
    costs = scenes(ready, arguments.rounds, say)
    data = as_json(costs)
    if folder is not None:
        from rig.bench.figures import scenes_figure  # noqa: PLC0415 - it needs matplotlib

        rows = [_flat(cost) for cost in costs]
        write_study(
            folder, "scenes", _HEAD, table(costs).splitlines(), data,
            csv_text(rows[0], rows), scenes_figure(costs),
        )  # fmt: skip
    print_found(data, lambda: table(costs), as_json=arguments.json)
    return 0


def table(costs: Sequence[Cost]) -> str:
    """Lay the costs out as text, then what each scene loads that the simplest does not."""
    first = costs[0].account
    rows = [
        ["scene", "modules", "peak MB", "check ms", "×", "predict ms", "×", "compute µs", "×",
         "bytecodes", "×", *first.evaluations]
    ]  # fmt: skip
    for cost in costs:
        account = cost.account
        work = account.operations["predict"]
        times = [
            cell
            for kind, scale in (("check", 1e3), ("predict", 1e3), ("compute", 1e6))
            for cell in (_quartiles(cost.seconds[kind], scale), f"{cost.ratios[kind].median:.3g}")
        ]
        rows.append(
            [cost.scene, str(len(account.modules)), f"{account.peak_bytes / 1e6:.1f}", *times,
             str(work), f"{work / first.operations['predict']:.3g}",
             *map(str, account.evaluations.values())]
        )  # fmt: skip
    lines = text_table(rows, left={0})
    width = max(len(cost.scene) for cost in costs)
    lines += [
        "",
        "medians with quartiles; × is over the simplest scene; bytecodes and the columns behind "
        "them: the prediction alone",
        f"{costs[0].scene} loads {len(first.rooms)} modules of rig"
        f" and {', '.join(first.packages) or 'no large package'}; beyond it load",
    ]
    for cost in costs[1:]:
        names = [name for name in cost.account.rooms if name not in first.rooms]
        names += [name for name in cost.account.packages if name not in first.packages]
        lines.append(f"  {cost.scene:<{width}}  {', '.join(names) or 'nothing'}")
    return "\n".join(lines)


def _quartiles(spread: Quartiles, scale: float) -> str:
    median, low, high = (value * scale for value in (spread.median, spread.low, spread.high))
    return f"{median:.4g} ({low:.4g}–{high:.4g})"


def _flat(cost: Cost) -> dict[str, object]:
    """One line of the CSV file."""
    account = cost.account
    line: dict[str, object] = {
        "scene": cost.scene,
        "modules": len(account.modules),
        "rig_modules": len(account.rooms),
        "packages": " ".join(account.packages),
        "peak_bytes": int(account.peak_bytes),
    }
    line |= {f"{name}_bytecodes": count for name, count in account.operations.items()}
    line |= account.evaluations
    for kind, seconds in cost.seconds.items():
        values = (*astuple(seconds), cost.ratios[kind].median)
        names = (f"{kind}_{part}" for part in ("s", "s_low", "s_high", "ratio"))
        line |= zip(names, values, strict=True)
    return line
