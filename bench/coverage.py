"""``./run bench coverage``."""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from bench.studies.coverage import CASES, held, merged, misfits
from rig.commands.output import leave_study, named, say, write_page
from rig.files import make_folder, write_atomic
from rig.measurands import MEASURANDS
from rig.text_table import csv_text, text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator, Mapping

    from bench.studies.coverage import CoverageCase, Held

    Record = Mapping[str, Any]

MISFIT_RIGS = 12
_CHUNK = 8  # rigs at a time
_HEAD = """\
# Does U hold the true value?

`./run bench coverage`: many rigs, each wrong by as much as its protocol states, a few drops on
each. 95 % of the intervals should hold the true value. ± of a share is from rig to rig. *rms
/ u*: rms error over the stated standard uncertainty. Void shares leave out drops beyond the
limit of release skew."""
_OTHER = {
    "drag_per_m": ("κ", "1/km", 1e3),
    "restitution": ("β", "", 1.0),
    "friction": ("μ", "", 1.0),
}


def main(arguments: Namespace) -> int:
    """Let rigs of every case drop their chains; keep the table as it grows, and print it."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # one process a core is quicker
    wanted = arguments.only or ""
    chosen = named(CASES, wanted)
    folder = make_folder(arguments.output)
    found: dict[str, Record] = {}
    wrong: dict[str, Record] = {}
    with ProcessPoolExecutor(arguments.jobs, get_context("spawn")) as pool:
        for case in chosen:
            one = _case(pool, arguments.protocols, case, arguments.rigs or case.rigs)
            found[case.name] = one.json()
            say(f"{case.name}: {found[case.name]['drops']} drops")
            write_atomic(folder / "coverage.csv", _csv(found))  # what is there when it is stopped
            write_page(folder, "coverage", _HEAD, _lines(found, wrong))
    if not wanted:
        with TemporaryDirectory() as scratch:
            for name, one in misfits(scratch, min(arguments.rigs or MISFIT_RIGS, MISFIT_RIGS)):
                wrong[name] = one.json()
                say(f"{name}: {wrong[name]['drops']} drops")
    leave_study(
        folder, "coverage", _HEAD, [*_lines(found, wrong)], {"cases": found, "misfits": wrong},
        _csv(found), as_json=arguments.json,
    )  # fmt: skip
    return 0


def _case(pool: ProcessPoolExecutor, folder: str, case: CoverageCase, rigs: int) -> Held:
    """Share a case's rigs among processes."""
    seeds = range(1, rigs + 1)
    parts = [seeds[n : n + _CHUNK] for n in range(0, rigs, _CHUNK)]
    return merged(pool.map(held, [folder] * len(parts), [case] * len(parts), parts))


def _lines(found: Mapping[str, Record], wrong: Mapping[str, Record]) -> Iterator[str]:
    """One table of drops, one of quantities a case, and one of wrong rigs."""
    rows = [["", "drops", "void", "marginal", "edges to a wrong rod"]]
    rows += [
        [name, str(one["drops"]), f"{one['void_share']:.1%}", f"{one['marginal_share']:.1%}",
         str(one["wrong"])]
        for name, one in found.items()
    ]  # fmt: skip
    yield from text_table(rows, left={0}, rule=True)
    for name, one in found.items():
        rows = [[name, "n", "rms", "bias", "mean U95", "in U95", "", "rms / u"]]
        rows += [_row(key, errors) for key, errors in one["quantities"].items() if "°" not in key]
        yield ""
        yield from text_table(rows, left={0, 6}, rule=True)
    if wrong:
        rows = [["wrong in", "drops", "void", "marginal", "no word: U holds", "U does not hold"]]
        rows += [
            [name, str(one["drops"]), f"{one['void_share']:.0%}", f"{one['marginal_share']:.0%}",
             f"{one['quiet_and_held']}", f"{one['quiet'] - one['quiet_and_held']}"]
            for name, one in wrong.items()
        ]  # fmt: skip
        yield ""
        yield from text_table(rows, left={0}, rule=True)


def _row(key: str, errors: Record) -> list[str]:
    mean = "mean " if key.startswith("mean ") else ""
    name = key.removeprefix("mean ")
    if name in MEASURANDS:
        row = MEASURANDS[name]
        symbol, unit, scale = row.label, row.fine, row.fine_scale
    else:
        symbol, unit, scale = _OTHER.get(name, (name, "", 1.0))
    sizes = [f"{errors[one] * scale:.3f}" for one in ("rms", "bias", "mean_U95")]
    chance = f"± {errors['coverage_se']:.1%}" if "coverage_se" in errors else ""
    held = f"{errors['coverage']:.1%}"
    label = f"{mean}{symbol} ({unit})" if unit else f"{mean}{symbol}"
    return [label, str(errors["n"]), *sizes, held, chance, f"{errors['times_u']:.2f}"]


def _csv(found: Mapping[str, Record]) -> str:
    """One line a case and quantity, of all drops and of each incline."""
    rows = [
        {"case": name, "quantity": key} | errors
        for name, one in found.items()
        for key, errors in one["quantities"].items()
    ]
    return csv_text(dict.fromkeys(key for row in rows for key in row), rows)
