"""The ``rig`` command: reads the command line, then loads only what the sub-command needs."""

from __future__ import annotations

import argparse
import os
import sys
from importlib import import_module
from typing import TYPE_CHECKING

from rig import __version__
from rig.errors import RigError

if TYPE_CHECKING:
    from collections.abc import Sequence

INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    0 done, 2 bad input, 3 a run was void, 4 device trouble, 130 interrupted. Results go to
    stdout, everything else to stderr.
    """
    # The matrices here are small: more threads only get into each other's way.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    arguments = _parser().parse_args(argv)
    try:
        code: int = import_module(f"rig.commands.{arguments.module}").main(arguments)
        sys.stdout.flush()
    except RigError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print("rig: interrupted; the same command goes on from here", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # Whoever read our output has seen enough; nothing more can be written to it.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="rig",
        description="Lab-rig controller for falling-chain and photogate experiments.",
        epilog="Exit codes: 0 done, 2 bad input, 3 a run was void, 4 device trouble, "
        "130 interrupted.",
    )
    parser.add_argument("--version", action="version", version=f"rig {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def command(name: str, text: str, module: str = "") -> argparse.ArgumentParser:
        added = commands.add_parser(name, help=text, description=text)
        added.set_defaults(module=module or name)
        return added

    run = command("run", "carry out a protocol, or what is left of it")
    _protocol(run)
    run.add_argument("--port", required=True, help="device path or URL; sim:// needs no hardware")
    run.add_argument(
        "--session", required=True, metavar="FILE", help="a new file, or one to be continued"
    )
    run.add_argument("--seed", type=int, metavar="N", help="of a simulation (default 0)")
    run.add_argument(
        "--yes", action="store_true", help="answer every prompt; implied when nobody can answer"
    )
    _json(run)

    _protocol(command("check", "say what a protocol's scene has and what follows from it"))

    predict = command("predict", "say what the model expects")
    _protocol(predict)
    _json(predict)

    imported = command("import", "make a session from the edges of another timer", "import_edges")
    imported.add_argument("events", metavar="EVENTS.csv", help="columns run,channel,time_s,state")
    imported.add_argument("--protocol", required=True, metavar="FILE", help="what was dropped")
    imported.add_argument("--session", required=True, metavar="FILE", help="the new session")
    imported.add_argument(
        "--clock-uncertainty",
        metavar="U",
        help='relative standard uncertainty of the timer, such as "50 ppm" (default 0.29 %%: a '
        "ceramic resonator)",
    )
    imported.add_argument(
        "--simulated", action="store_true", help="the edges come from a simulation"
    )

    analyze = command("analyze", "compute the results of a session")
    _session(analyze)
    _json(analyze)

    report = command("report", "write the results of a session as one HTML page")
    _session(report)
    report.add_argument("-o", "--output", required=True, metavar="FILE", help="the page")
    report.add_argument("--figures", metavar="DIR", help="folder for the figures as SVG files too")

    export = command("export", "write a session's results and edges as CSV files")
    _session(export)
    export.add_argument("--csv", required=True, metavar="DIR", help="folder for the files")

    _session(command("replay", "feed the recorded bytes through the whole stack and compare"))

    bench = command("bench", "measure accuracy against the simulation's hidden truth")
    benches = bench.add_subparsers(required=True, metavar="BENCH")
    accuracy = benches.add_parser("accuracy", help="errors of Δz, V and skew, coverage, matches")
    accuracy.set_defaults(module="bench_accuracy")
    accuracy.add_argument(
        "--protocol", default="protocols/inclined-uniform.yaml", metavar="FILE", help="the scene"
    )
    accuracy.add_argument("--port", default="sim://", help="simulation URL, with dials if wanted")
    accuracy.add_argument("--seeds", type=int, default=5, metavar="N", help="sessions to simulate")
    _json(accuracy)
    return parser


def _protocol(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("protocol", metavar="PROTOCOL", help="the protocol file (YAML)")


def _session(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("session", metavar="SESSION", help="the session file")


def _json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")


if __name__ == "__main__":
    sys.exit(main())
