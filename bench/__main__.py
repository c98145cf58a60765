"""``python -m bench NAME``, as ``./run bench NAME`` calls it: one benchmark of the software."""

from __future__ import annotations

import argparse
import os
import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.errors import RigError

if TYPE_CHECKING:
    from collections.abc import Sequence

INTERRUPTED = 130
BOARDS = ["sim", "emu", "bought"]
FAULTS = ["daemon", "runner", "cable", "reset", "brownout", "disk", "noise", "busy", "race", "deaf"]
WORLDS = ["model", "resolved", "piles", "mujoco", "coefficients", "stated", "usual"]


class Option(NamedTuple):
    """An option of a bench, as `argparse` takes it."""

    names: tuple[str, ...]
    settings: dict[str, Any]


class Bench(NamedTuple):
    """A bench: its module below ``bench``, what it finds, and its options; of `either` one."""

    module: str
    help: str
    options: Sequence[Option]
    either: Sequence[Option] = ()


def main(argv: Sequence[str] | None = None) -> int:
    """Run one benchmark and return its exit code, as the ``rig`` command does."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded
    arguments = _parser().parse_args(argv)
    from rig.commands.study import carry_out  # noqa: PLC0415 - with numpy, which --help does not need

    try:
        module = import_module(f"bench.{BENCHES[arguments.bench].module}")
        return carry_out(arguments.bench, module.run, arguments)
    except RigError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        return INTERRUPTED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="./run bench", description="Benchmarks of the software.")
    benches = parser.add_subparsers(required=True, metavar="BENCH", dest="bench")
    for name, bench in BENCHES.items():
        options = benches.add_parser(name, help=bench.help)
        for names, settings in bench.options:
            options.add_argument(*names, **settings)
        if bench.either:
            group = options.add_mutually_exclusive_group(required=True)
            for names, settings in bench.either:
                group.add_argument(*names, **settings)
        options.add_argument("--json", action="store_true", help="print JSON instead of a table")
    return parser


def _count(text: str) -> int:
    number = int(text)
    if number < 1:
        raise ValueError(text)
    return number


def _seed(text: str) -> int:
    if not text.isdecimal() or int(text) >= 2**63:
        raise ValueError(text)
    return int(text)


def _option(*names: str, **settings: Any) -> Option:
    return Option(names, settings)


def _number(name: str, words: str, default: int | None = None, **settings: Any) -> Option:
    return _option(name, **{"type": _count, "default": default, "metavar": "N", "help": words}
                   | settings)  # fmt: skip


def _switch(name: str, words: str) -> Option:
    return _option(name, action="store_true", help=words)


def _folder(words: str, *, required: bool = True) -> Option:
    return _option("-o", "--output", required=required, metavar="DIR", help=words)


def _scene(file: str = "protocols/inclined-uniform.yaml") -> Option:
    return _option("--protocol", default=file, metavar="FILE", help="the scene")


_PAGE = _folder("folder for a page of the same", required=False)
_FILES = _folder("folder for page, CSV and JSON")
_JOBS = _number("--jobs", "processes at a time")
_SIDE_BY_SIDE = _number("--jobs", "side by side", 1)
_SEED = _option("--seed", type=_seed, default=1, metavar="N", help="of the simulation")
_LAYOUT = _option("--only", metavar="TEXT", help='layouts such as "10 rods: 2 + 2"')
_PROTOCOLS = _option(
    "--protocols", default="protocols", metavar="DIR", help="where the ready protocols are"
)

BENCHES = {
    "bulk": Bench("studies.bulk", "many falls in Python, numpy, numba and C; limits of speed", (
        _folder("folder for a page of the same", required=False),
        _number("--falls", "in a batch", 100_000),
        _number("--rounds", "of measurement", 15),
    )),
    "coverage": Bench("studies.coverage", "how often intervals hold, over drawn rigs", (
        _FILES, _SEED, _JOBS, _PROTOCOLS,
        _number("--rigs", "of each world"),
        _number("--only", "rigs by number", nargs="+"),
        _option("--world", nargs="+", choices=WORLDS,
                help="only these; all but mujoco by default, which needs pip install mujoco"),
    )),
    "dataset": Bench("studies.dataset", "an open data set, and who reads it well", (
        _folder("folder for data set, page, CSV and JSON"),
        _number("--repeats", "drops at each incline (default 2)", 2),
        _option("--only", metavar="TEXT", default="", help='sessions such as "graded" or "dead"'),
        _option("--score", metavar="FILE", help="only score these readings of that data set"),
    )),
    "diagnoses": Bench("studies.diagnoses", "which faults of a rig are named rightly", (
        _FILES, _LAYOUT, _JOBS,
        _number("--drops", "with each fault of each size on each layout"),
        _option("--clean", type=int, metavar="N", help="on each layout without a fault"),
    )),
    "estimators": Bench("studies.estimators", "error against run time from edges to Δz and V", (
        _FILES, _scene(), _SEED, _number("--repeats", "drops at each incline (default 1)", 1),
    )),
    "faults": Bench("faults", "kill, pull and garble sessions; count what is lost", (
        _number("--share", "of the full counts", 100, metavar="PERCENT"),
        _number("--jobs", "rigs side by side", 6),
        _option("--board", dest="boards", nargs="+", choices=BOARDS, default=BOARDS,
                help="virtual, real firmware in an emulator, or that behind a boot loader"),
        _option("--kind", dest="kinds", nargs="+", metavar="KIND", choices=FAULTS,
                help="only these"),
    )),
    "layouts": Bench("studies.layouts", "which layouts of gates let drops be read", (
        _FILES, _LAYOUT, _JOBS,
        _number("--drops", "on each layout with each disturbance (default 12)", 12),
    )),
    "link": Bench("link", "edges a second, latency, an idle daemon's costs", (_PAGE,)),
    "mutation": Bench("mutation", "faults put into the software: who notices?", (
        _folder("write a table there", required=False), _SIDE_BY_SIDE,
        _number("--mutants", "in all", 200),
        _option("--seed", type=int, default=1, help="which ones"),
        _option("--rooms", nargs="+", metavar="ROOM", help="only in these"),
    )),
    "pictures": Bench("pictures", "all pages of the terminal as SVG files", (
        _folder("write a file a page and size there"),
        _option("--session", required=True, metavar="FILE", help="with a drop at least"),
    )),
    "resolved": Bench("studies.resolved", "the resolved world by itself", (
        _folder("folder for what is made"),
        _number("--falls", "of 25 rods with each step", 48),
    ), either=(
        _switch("--work", "error against run time of that world itself"),
        _switch("--published", "chains of other experiments in that world"),
        _option("--paper", type=int, choices=[3, 4], help="that world in a figure of the paper"),
    )),
    "tui": Bench("tui", "what the screen costs, and how late it is", (_PAGE, _scene())),
}  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
