"""``rig bench scenes``."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import astuple
from pathlib import Path
from typing import TYPE_CHECKING

from rig.bench.scenes import as_json, scenes
from rig.commands.output import print_json, say
from rig.errors import InputError
from rig.files import write_atomic
from rig.text_table import text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Sequence

    from rig.bench.scenes import Cost, Quartiles


def main(arguments: Namespace) -> int:
    """Measure every scene, keep the table, print it."""
    folder = None if arguments.output is None else Path(arguments.output)
    if folder is not None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            reason = error.strerror or error
            raise InputError(f"cannot make the folder {folder}: {reason}") from error
    ready = sorted(Path(arguments.protocols).glob("*.yaml"))
    if not ready:
        say(f"no protocols in {arguments.protocols}: left out the ready ones")
    costs = scenes(ready, arguments.rounds, say)
    whole = as_json(costs)
    if folder is not None:
        _write(folder, costs, json.dumps(whole, indent=2, ensure_ascii=False))
    if arguments.json:
        print_json(whole)
    else:
        print(table(costs))
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
        more = [name for name in cost.account.rooms if name not in first.rooms]
        more += [name for name in cost.account.packages if name not in first.packages]
        lines.append(f"  {cost.scene:<{width}}  {', '.join(more) or 'nothing'}")
    return "\n".join(lines)


def _quartiles(spread: Quartiles, scale: float) -> str:
    median, low, high = (value * scale for value in (spread.median, spread.low, spread.high))
    return f"{median:.4g} ({low:.4g}–{high:.4g})"


def _write(folder: Path, costs: Sequence[Cost], text: str) -> None:
    """Write ``scenes.csv``, ``scenes.json`` and the picture."""
    from rig.bench.figures import scenes_figure  # noqa: PLC0415 - it needs matplotlib

    lines = io.StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    account = costs[0].account
    kinds = list(costs[0].seconds)
    writer.writerow(
        ["scene", "modules", "rig_modules", "packages", "peak_bytes",
         *(f"{name}_bytecodes" for name in account.operations), *account.evaluations,
         *(f"{kind}_{part}" for kind in kinds for part in ("s", "s_low", "s_high", "ratio"))]
    )  # fmt: skip
    for cost in costs:
        account = cost.account
        times = [
            value
            for kind in kinds
            for value in (*astuple(cost.seconds[kind]), cost.ratios[kind].median)
        ]
        writer.writerow(
            [cost.scene, len(account.modules), len(account.rooms), " ".join(account.packages),
             int(account.peak_bytes), *account.operations.values(),
             *account.evaluations.values(), *times]
        )  # fmt: skip
    write_atomic(folder / "scenes.csv", lines.getvalue())
    write_atomic(folder / "scenes.json", text + "\n")
    write_atomic(folder / "scenes.svg", scenes_figure(costs))
