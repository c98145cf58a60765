"""``./run bench coverage``."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from bench.studies.coverage import (
    COEFFICIENTS,
    MODULES,
    WORLDS,
    draw_rigs,
    groups,
    measure,
    summarize,
    worst_tenth,
)
from bench.workers import results
from rig.commands.output import print_found, progress, say, write_study
from rig.errors import InputError
from rig.files import make_folder
from rig.measurands import MEASURANDS
from rig.text_table import csv_text, text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator, Mapping, Sequence

    from bench.studies.coverage import RigResult

    Record = Mapping[str, Any]

RIGS = {"model": 200, "resolved": 200, "mujoco": 40, COEFFICIENTS: 20}
_CHUNK = 4  # rigs for one process of the simulation
_HEAD = """\
# Does U hold the true value?

`./run bench coverage`: rigs drawn by a Latin hypercube over layout, rods, incline, drops a session
and what the protocol does not know: air, and in the resolved world strings, swing and place along
the beams. Each rig is wrong by as much as its protocol states. 95 % of the intervals should hold
the true value. ± of a share is from rig to rig. *rms / u*: rms error over the stated standard
uncertainty. Void shares leave out drops beyond the limit of release skew. The worst tenth of rigs
stands below each world: the same `--rigs` and `--seed` with `--only NUMBER` draw a rig again."""
_DROPS = (
    "separation_m", "separation_raw_m", "separation_strike_m", "speed_m_s", "speed_strike_m_s",
    "release_skew_s", "fall_time_s",
)  # fmt: skip
_OTHER = {
    "drag_per_m": ("κ", "1/km", 1e3),
    "restitution": ("β", "", 1.0),
    "friction": ("μ", "", 1.0),
}


def main(arguments: Namespace) -> int:
    """Let chains fall on the rigs of each world; keep page and table as they grow, and print."""
    worlds = arguments.world or [one for one in WORLDS if one not in MODULES]
    if "mujoco" in worlds and find_spec("mujoco") is None:
        raise InputError("the world mujoco needs MuJoCo", ".venv/bin/pip install mujoco")
    folder = make_folder(arguments.output)
    whole: dict[str, Any] = {}
    lines: list[str] = []
    rows: list[Record] = []
    for world in worlds:
        rigs = draw_rigs(arguments.protocols, world, arguments.rigs or RIGS[world], arguments.seed)
        rigs = [one for one in rigs if one.number in (arguments.only or [one.number])]
        if not rigs:
            raise InputError("no rig of the cube has such a number", "give --only up to --rigs")
        parts = [(measure, rigs[n : n + _CHUNK]) for n in range(0, len(rigs), _CHUNK)]
        found: list[RigResult] = []
        count = progress(world)
        for part in results(parts, arguments.jobs):
            found += part
            count(len(found), len(rigs))
        whole[world] = _record(found)
        rows += whole[world]["rigs"]
        lines += [*([""] if lines else []), *_lines(world, found, whole[world])]
        say(f"{world}: {whole[world]['all']['drops']} drops of {len(rigs)} rigs")
        table = csv_text(dict.fromkeys(name for row in rows for name in row), rows)
        write_study(folder, "coverage", _HEAD, lines, whole, table)
    print_found(whole, lambda: "\n".join(["SIMULATED DATA", *lines]), as_json=arguments.json)
    return 0


def _record(found: Sequence[RigResult]) -> dict[str, Any]:
    """Return all figures of a world."""
    worst = worst_tenth(found)
    return {
        "all": summarize(found),
        "sessions": summarize(found, session=True)["quantities"],
        "groups": {name: summarize(rigs) for name, rigs in (groups(found) | worst).items()},
        "worst": {name: [one.rig.number for one in rigs] for name, rigs in worst.items()},
        "rigs": [one.row() for one in found],
    }


def _lines(world: str, found: Sequence[RigResult], record: Record) -> Iterator[str]:
    """Write the tables of a world."""
    quantities = record["all"]["quantities"] | record["sessions"]
    rows = [[world, "n", "rms", "bias", "median U95", "in U95", "", "rms / u"]]
    rows += [_row(name, errors) for name, errors in quantities.items()]
    yield from text_table(rows, left={0, 6}, rule=True)
    yield ""
    names = [name for name in _DROPS if name in quantities]
    symbols = [MEASURANDS[name].label for name in names]
    rows = [["in U95", "rigs", "drops", "void", "wrong edges", "ms a drop", *symbols]]
    for group, one in ({"all": record["all"]} | record["groups"]).items():
        rows.append([
            group, str(one["rigs"]), str(one["drops"]), f"{one['void_share']:.1%}",
            str(one["wrong"]), f"{one['ms_per_drop']:.0f}",
            *(_share(one["quantities"].get(name)) for name in names),
        ])  # fmt: skip
    yield from text_table(rows, left={0}, rule=True)
    silent = [one.rig.number for one in found if not one.intervals]
    if silent:
        yield f"all drops void: rigs {', '.join(map(str, silent))}"
    for name, rigs in worst_tenth(found).items():
        yield ""
        yield f"{name}:"
        yield from _worst([one.row() for one in rigs])


def _worst(rows: Sequence[Record]) -> list[str]:
    """Describe rigs, so that each can be drawn again."""
    names = [name for name in rows[0] if name not in _HIDDEN]
    heads = [_HEADINGS.get(name, name) for name in names]
    return text_table([heads, *([_text(row[name]) for name in names] for row in rows)], rule=True)


_HIDDEN = {"world", "heights", "wrong", "ms_per_drop"}
_HEADINGS = {
    "number": "rig", "incline_deg": "incline (°)", "drag": "κ (1/m)",
    "string_restitution": "strings", "string_strain": "strain (%)", "swing_sd": "swing (cm/s)",
    "off_centre_sd": "off centre (mm)", "worst_ratio": "|error| / U", "worst_quantity": "of",
}  # fmt: skip


def _text(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def _share(errors: Record | None) -> str:
    if errors is None:
        return ""
    se = f" ± {errors['coverage_se']:.0%}" if "coverage_se" in errors else ""
    return f"{errors['coverage']:.0%}{se}"


def _row(key: str, errors: Record) -> list[str]:
    mean = "mean " if key.startswith("mean ") else ""
    name = key.removeprefix("mean ")
    if name in MEASURANDS:
        row = MEASURANDS[name]
        symbol, unit, scale = row.label, row.fine, row.fine_scale
    else:
        symbol, unit, scale = _OTHER.get(name, (name, "", 1.0))
    sizes = [f"{errors[one] * scale:.3f}" for one in ("rms", "bias", "median_U95")]
    chance = f"± {errors['coverage_se']:.1%}" if "coverage_se" in errors else ""
    held = f"{errors['coverage']:.1%}"
    label = f"{mean}{symbol} ({unit})" if unit else f"{mean}{symbol}"
    return [label, str(errors["n"]), *sizes, held, chance, f"{errors['times_u']:.2f}"]
