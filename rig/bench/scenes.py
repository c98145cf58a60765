"""``rig bench scenes``: what each scene costs beside the whole, and that it gains nothing else.

Counts are the same on every run of a Python version. Processor times are not: every scene is timed
in every round, ratios are taken within a round, and medians are given.
"""

import json
import os
import subprocess
import sys
from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from rig.bench.figures import scenes_figure
from rig.bench.findings import Findings
from rig.errors import RigError
from rig.protocol.protocol import Protocol
from rig.protocol.reader import parse
from rig.streams import say
from rig.text_rows import read_paragraphs, read_text
from rig.text_table import text_table

_TABLES = {heading: lines for heading, *lines in read_paragraphs(__file__)}
PARTS = {
    part.strip(): {*names.strip().split(", ")}
    for part, _, names in (line.partition("|") for line in _TABLES["Parts"])
}
"""Modules and calls that only a scene with this part may need; no prediction has figures."""
_PROBE = "from rig.bench.scene_probe import main; main()"
_PROBES = 3


class Cost(NamedTuple):
    """What one scene costs.

    Attributes
    ----------
    modules
        Names of all modules that ``rig predict`` has loaded, Python's own included.
    bytes
        What Python holds when the command is done, the least and the most of some processes.
    calls
        Of the prediction alone: of all functions, and of `rig.bench.scene_probe.COUNTED`.
    command_s, command_share
        Processor time of ``rig predict``, Python's start included, and that over the whole's.
    gained
        What belongs to a part that this scene does not have; nothing, or the study fails.
    """

    scene: str
    modules: list[str]
    bytes: tuple[int, int]
    calls: dict[str, int]
    command_s: float
    command_share: float
    gained: tuple[str, ...]

    @property
    def rooms(self) -> list[str]:
        """Modules of this program."""
        return [name for name in self.modules if name.partition(".")[0] == "rig"]


def ladder() -> dict[str, str]:
    """Return the paper's chain, from free fall to the whole experiment, as protocols by name."""
    texts = {name: "\n".join(lines) + "\n" for name, lines in _TABLES.items()}
    rows = (line.split("|") for line in _TABLES["Ladder"])
    return {name.strip(): "".join(map(texts.__getitem__, pieces.split())) for name, pieces in rows}


def run(arguments: Namespace) -> Iterator[Findings]:
    """Measure the ladder, then ready protocols; fail where a scene gains what it does not have."""
    texts = ladder()
    paths = sorted(Path(arguments.protocols).glob("*.yaml"))
    if not paths:
        say(f"no protocols in {arguments.protocols}: left out the ready ones")
    texts |= {path.stem: path.read_text("utf-8") for path in paths}
    costs = measure(texts, arguments.rounds)
    names = [cost.scene for cost in costs]
    whole = next(cost for cost in costs if cost.scene == "whole")
    panels = {
        "modules\nof rig": [float(len(cost.rooms)) for cost in costs],
        "rig predict,\nof the whole": [cost.command_share for cost in costs],
        "calls,\nof the whole": [cost.calls["calls"] / whole.calls["calls"] for cost in costs],
    }
    rows = [_row(cost) for cost in costs]
    table = text_table([[*rows[0]], *([*row.values()] for row in rows)], left={0}, rule=True)
    yield Findings(
        {"python": sys.version.split()[0], "scenes": [cost._asdict() for cost in costs]},
        [*table, *_remarks(costs, whole)],
        read_text(__file__, "scenes.md").rstrip(),
        rows,
        scenes_figure(names, panels),
        failed=any(cost.gained for cost in costs),
    )


def measure(texts: Mapping[str, str], rounds: int) -> list[Cost]:
    """Measure scenes; the one named ``whole`` is what the others are compared with.

    Parameters
    ----------
    texts
        Protocols by name.
    rounds
        Of timing.

    Raises
    ------
    InputError
        If a protocol is bad.
    RigError
        If a scene's process fails, or counts differently when it is asked again.
    """
    protocols = {name: parse(text, name) for name, text in texts.items()}
    with TemporaryDirectory() as folder:
        files = {name: Path(folder) / f"{n}.yaml" for n, name in enumerate(texts)}
        for name, file in files.items():
            file.write_text(texts[name], "utf-8")
        say("counting and timing …")
        counts = {name: _count(file) for name, file in files.items()}
        times = [
            {name: _probe(file)["seconds"] for name, file in files.items()} for _ in range(rounds)
        ]
    return [
        Cost(
            name,
            **counted,
            command_s=median(turn[name] for turn in times),
            command_share=median(turn[name] / turn["whole"] for turn in times),
            gained=_unneeded_parts(protocols[name], counted),
        )
        for name, counted in counts.items()
    ]


def _count(file: Path) -> dict[str, Any]:
    reports = [_probe(file, "-X", "tracemalloc") for _ in range(_PROBES)]
    sizes, _ = zip(*((each.pop("bytes"), each.pop("seconds")) for each in reports), strict=True)
    if reports.count(reports[0]) < _PROBES:
        raise RigError(f"{file.name}: two equal runs do not count the same")
    return {**reports[0], "bytes": (min(sizes), max(sizes))}


def _probe(file: Path, *options: str) -> Any:
    """Have a fresh Python process look at a scene, and return what it says."""
    process = subprocess.run(
        [sys.executable, *options, "-c", _PROBE, str(file)],
        capture_output=True,
        encoding="utf-8",
        check=False,
        env={**os.environ, "PYTHONHASHSEED": "0", "PYTHONUTF8": "1"},
    )
    if process.returncode:
        raise RigError("a scene could not be measured", process.stderr.strip())
    return json.loads(process.stdout)


def _unneeded_parts(protocol: Protocol, counted: Mapping[str, Any]) -> tuple[str, ...]:
    """List what was loaded or called for parts that the scene does not have."""
    from_surface = any(rods.chain.alpha is None for rods in protocol.chains.values())
    present: dict[str, object] = {
        "surface": protocol.surface,
        "air": protocol.drag,
        "gates": protocol.gates,
        "inclined surface": protocol.surface and from_surface and max(protocol.plan.inclines) > 0.0,
    }
    used = {*counted["modules"], *(name for name, calls in counted["calls"].items() if calls)}
    absent = [part for part in PARTS if not present.get(part)]
    return tuple(f"{name} ({part})" for part in absent for name in sorted(PARTS[part] & used))


def _row(cost: Cost) -> dict[str, str]:
    """Return a line of the table, which is also that of the CSV file."""
    least, most = cost.bytes
    return {
        "scene": cost.scene,
        "modules": f"{len(cost.modules)}",
        "of rig": f"{len(cost.rooms)}",
        "MB held": f"{least / 1e6:.2f}–{most / 1e6:.2f}",
        "command ms": f"{1e3 * cost.command_s:.1f}",
        "command ×": f"{cost.command_share:.2g}",
        **{name: f"{calls}" for name, calls in cost.calls.items()},
    }


def _remarks(costs: Sequence[Cost], whole: Cost) -> Iterator[str]:
    """Say what each scene leaves out that the whole has, and what one gained."""
    yield from ("", "× is over the whole; left out of the whole:")
    for cost in costs:
        without = sorted(set(whole.rooms) - set(cost.rooms))
        without += [name for name, calls in whole.calls.items() if calls and not cost.calls[name]]
        yield f"  {cost.scene}: {', '.join(without) or 'nothing'}"
    faults = [f"{cost.scene} gained {name}" for cost in costs for name in cost.gained]
    yield from ("", *(faults or ["no scene gained what it does not have"]))
