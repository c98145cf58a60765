"""``python -m bench NAME``, as ``./run bench NAME`` calls it: one benchmark of the software."""

from __future__ import annotations

import argparse
import os
import sys
from importlib import import_module
from typing import TYPE_CHECKING

from rig.errors import RigError

if TYPE_CHECKING:
    from collections.abc import Sequence

INTERRUPTED = 130
_SCENE = "protocols/inclined-uniform.yaml"
BOARDS = ["sim", "emu", "bought"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run one benchmark and return its exit code, as the ``rig`` command does."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded
    arguments = _parser().parse_args(argv)
    try:
        code: int = import_module(f"bench.{arguments.bench}").main(arguments)
    except RigError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        return INTERRUPTED
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="./run bench", description="Benchmarks of the software.")
    benches = parser.add_subparsers(required=True, metavar="BENCH", dest="bench")

    agreement = benches.add_parser("agreement", help="how rarely a true model is refuted")
    agreement.add_argument("--sessions", type=_count, default=100, metavar="N", help="to simulate")
    agreement.add_argument(
        "--drops",
        type=_count,
        nargs="+",
        default=[1, 2, 4, 12],
        metavar="N",
        help="at each incline",
    )
    agreement.add_argument("--protocol", default=_SCENE, metavar="FILE", help="the scene")
    agreement.add_argument("-o", "--output", metavar="DIR", help="folder for page and CSV")
    agreement.add_argument(
        "--more", action="store_true", help="go on with the sessions of that folder"
    )
    agreement.add_argument("--jobs", type=_count, default=1, metavar="N", help="side by side")

    clock = benches.add_parser("clock", help="how well the board's clock is known after a time")
    clock.add_argument(
        "--protocol", default="protocols/picket-fence.yaml", metavar="FILE", help="any scene"
    )
    clock.add_argument("--seeds", type=_count, default=20, metavar="N", help="lines to simulate")

    faults = benches.add_parser("faults", help="kill, pull and garble sessions; count what is lost")
    faults.add_argument(
        "--share", type=_count, default=100, metavar="PERCENT", help="of the full counts"
    )
    faults.add_argument("--jobs", type=_count, default=6, metavar="N", help="rigs side by side")
    faults.add_argument(
        "--board", dest="boards", nargs="+", choices=BOARDS, default=BOARDS,
        help="virtual, real firmware in an emulator, or that behind Arduino's boot loader",
    )  # fmt: skip
    faults.add_argument(
        "--kind", dest="kinds", nargs="+", metavar="KIND", help="only these",
        choices=["daemon", "runner", "cable", "reset", "brownout", "disk", "noise", "busy", "race",
                 "deaf"],
    )  # fmt: skip

    link = benches.add_parser("link", help="edges a second, latency, an idle daemon's costs")
    link.add_argument("-o", "--output", metavar="DIR", help="folder for a page of the same")

    hostile = benches.add_parser("hostile_files", help="altered files through all commands")
    hostile.add_argument("--sessions", type=_count, default=2000, metavar="N")
    hostile.add_argument("--protocols", type=_count, default=2000, metavar="N")
    hostile.add_argument("--tables", type=_count, default=1000, metavar="N", help="of other timers")
    hostile.add_argument("--seed", type=int, default=0, help="of the first")

    soak = benches.add_parser("soak", help="runs without end, and days on which nothing happens")
    soak.add_argument("--runs", type=_count, default=10_000, metavar="N")
    soak.add_argument("--hours", type=float, default=24.0, metavar="H", help="of virtual time")

    mutation = benches.add_parser("mutation", help="faults put into the software: who notices?")
    mutation.add_argument("--mutants", type=_count, default=200, metavar="N", help="in all")
    mutation.add_argument("--seed", type=int, default=1, help="which ones")
    mutation.add_argument("--rooms", nargs="+", metavar="ROOM", help="only in these")
    mutation.add_argument("--where", default="", metavar="TEXT", help="only those that have it")
    mutation.add_argument("--jobs", type=_count, default=1, metavar="N", help="side by side")
    mutation.add_argument("--list", action="store_true", help="only say which they are")
    mutation.add_argument("-o", dest="output", metavar="DIR", help="write a table there")
    mutation.add_argument(
        "--most", type=float, default=600.0, metavar="S", help="of tests each, the quickest first"
    )
    mutation.add_argument("--page", metavar="FILE", help="write what came of it there")

    pictures = benches.add_parser("pictures", help="all pages of the terminal as SVG files")
    pictures.add_argument("--session", required=True, metavar="FILE", help="with a drop at least")
    pictures.add_argument(
        "-o", dest="output", required=True, metavar="DIR", help="write a file a page and size there"
    )

    states = benches.add_parser("states", help="every state of a drop, with all that goes wrong")
    states.add_argument(
        "--depths", type=_count, nargs=2, default=[5, 3], metavar="N",
        help="steps from the beginning: undisturbed, and disturbed at each moment",
    )  # fmt: skip

    stop = benches.add_parser("stop", help="how long STOP takes to the wire, whatever is going on")
    stop.add_argument("--stops", type=_count, default=50, metavar="N", help="in each condition")

    tui = benches.add_parser("tui", help="what the screen costs, and how late it is")
    tui.add_argument("--protocol", default=_SCENE, metavar="FILE", help="the scene")
    tui.add_argument("-o", dest="output", metavar="DIR", help="write a table there")
    _studies(benches)
    for bench in benches.choices.values():
        bench.add_argument("--json", action="store_true", help="print JSON instead of a table")
    return parser


def _studies(benches: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Benches of simulated falls and what is made of them."""

    def study(name: str, text: str, folder: str, *, needed: bool = True) -> argparse.ArgumentParser:
        bench = benches.add_parser(name, help=text)
        bench.add_argument("-o", "--output", required=needed, metavar="DIR", help=folder)
        return bench

    accuracy = study(
        "accuracy", "errors of Δz, V and skew, coverage, matches", "folder for a page of the same",
        needed=False,
    )  # fmt: skip
    accuracy.add_argument("--seeds", type=_count, metavar="N", help="sessions to simulate")
    accuracy.add_argument(
        "--repeats", type=_count, metavar="N", help="drops at each incline, not the protocol's"
    )
    accuracy.add_argument(
        "--doubled", action="store_true",
        help="many short sessions, also with each dial of the simulation doubled",
    )  # fmt: skip
    accuracy.add_argument("--jobs", type=_count, metavar="N", help="cases at a time")
    every = study(
        "estimators", "error against run time from edges to Δz and V",
        "folder for page, CSV, JSON and picture",
    )  # fmt: skip
    for bench in (accuracy, every):
        bench.add_argument("--protocol", default=_SCENE, metavar="FILE", help="the scene")
        bench.add_argument("--port", default="sim://", help="simulation URL, with dials if wanted")
    every.add_argument("--seed", type=_seed, default=1, metavar="N", help="of the simulation")
    every.add_argument(
        "--repeats", type=_count, default=4, metavar="N", help="drops at each incline (default 4)"
    )
    every.add_argument(
        "--budget", type=_count, default=120, metavar="S",
        help="seconds that one Monte Carlo setting may take (default 120)",
    )  # fmt: skip
    coverage = study(
        "coverage", "how often intervals hold, over drawn rigs", "folder for page, CSV and JSON"
    )
    coverage.add_argument("--rigs", type=_count, metavar="N", help="of each world")
    coverage.add_argument("--seed", type=_seed, default=1, metavar="N", help="of the hypercube")
    coverage.add_argument(
        "--world", nargs="+", choices=["model", "resolved", "mujoco", "coefficients"],
        help="only these; all but mujoco by default, which needs pip install mujoco",
    )  # fmt: skip
    coverage.add_argument("--only", type=_count, nargs="+", metavar="N", help="rigs by number")
    coverage.add_argument("--jobs", type=_count, metavar="N", help="processes at a time")
    resolved = study("resolved", "the resolved world by itself", "folder for what is made")
    asked = resolved.add_mutually_exclusive_group(required=True)
    asked.add_argument("--film", type=float, metavar="DEG", help="draw one fall at this incline")
    asked.add_argument(
        "--work", action="store_true", help="error against run time of that world itself"
    )
    asked.add_argument(
        "--published", action="store_true", help="chains of other experiments in that world"
    )
    for bench in (coverage, resolved):
        bench.add_argument(
            "--protocols", default="protocols", metavar="DIR", help="where the ready protocols are"
        )
    layouts = study(
        "layouts", "which layouts of gates let drops be read", "folder for CSV, JSON, page and map"
    )
    layouts.add_argument(
        "--drops", type=_count, metavar="N", help="on each layout with each disturbance"
    )
    layouts.add_argument(
        "--more", action="store_true", help="add to what is in that folder, each drop on a new rig"
    )
    diagnoses = study(
        "diagnoses", "which faults of a rig are named rightly", "folder for table, page and JSON"
    )
    diagnoses.add_argument(
        "--drops", type=_count, metavar="N", help="with each fault of each size on each layout"
    )
    diagnoses.add_argument("--clean", type=int, metavar="N", help="on each layout without a fault")
    for bench in (layouts, diagnoses):
        bench.add_argument("--only", metavar="TEXT", help='layouts such as "10 rods: 2 + 2"')
        bench.add_argument("--jobs", type=_count, metavar="N", help="layouts at a time")
    foretold = study(
        "foretold", "what rig design foretells, and what comes of it",
        "folder for page, CSV and JSON",
    )  # fmt: skip
    foretold.add_argument(
        "--repeats", type=_count, default=4, metavar="N", help="drops at each incline (default 4)"
    )
    foretold.add_argument("--seed", type=_seed, default=1, metavar="N", help="of the simulation")
    foretold.add_argument("--only", metavar="TEXT", help="protocols with this in their names")
    bulk = benches.add_parser("bulk", help="one fall, batches, a C loop and a solver, in ratios")
    bulk.add_argument("--falls", type=_count, default=100_000, metavar="N", help="in a batch")
    bulk.add_argument("--rounds", type=_count, default=15, metavar="N", help="of measurement")


def _count(text: str) -> int:
    number = int(text)
    if number < 1:
        raise ValueError(text)
    return number


def _seed(text: str) -> int:
    if not text.isdecimal() or int(text) >= 2**63:
        raise ValueError(text)
    return int(text)


if __name__ == "__main__":
    sys.exit(main())
