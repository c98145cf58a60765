"""The ``rig`` command: reads the command line, then loads only what the sub-command needs."""

from __future__ import annotations

import argparse
import math
import os
import signal
import sys
import threading
from contextlib import contextmanager
from importlib import import_module
from typing import TYPE_CHECKING

from rig import __version__
from rig.boards import BOARDS, FLASHED
from rig.command_help import Parser, overview, runnable
from rig.errors import RigError
from rig.streams import open_streams, say, settle_streams

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

BAD_INPUT = 2
INTERRUPTED = 130
OPTIONAL = ("distributed", "mpmath")
"""Packages that few need: clusters for `rig sweep`, 50 digits for some of `rig bench`."""


class _ListFormats(argparse.Action):
    """Print the formats of timers' files that are known, and stop."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        rows = import_module("rig.timers.vocabulary").formats()
        sys.stdout.writelines(f"{name}: {how}; {example}\n" for name, _, how, example in rows)
        parser.exit()


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    0 done, 2 bad input, 3 a run was void, 4 device trouble, 130 interrupted; 1 if a replay differs,
    and from `rig.__main__` after an exception that is raised here. Results go to stdout, everything
    else to stderr.
    """
    open_streams()
    try:
        return _run(argv)
    finally:
        settle_streams()


def _run(argv: Sequence[str] | None) -> int:
    if "_ARGCOMPLETE" in os.environ:  # a shell asks what may follow; this does not return
        import argcomplete  # noqa: PLC0415 - nobody else needs it

        argcomplete.autocomplete(_parser())
    try:
        parser = _parser()
        try:
            arguments = parser.parse(argv)
        finally:
            sys.stdout.flush()  # of --help, here, where a closed pipe is understood
        if "module" not in arguments:
            say(parser.format_help(), end="")
            return BAD_INPUT
        command = import_module(f"rig.commands.{arguments.module}")
        with _put_in_order():
            code: int = command.main(arguments)
            sys.stdout.flush()
    except RigError as error:
        say(runnable(str(error)))
        return error.exit_code
    except (KeyboardInterrupt, RuntimeError) as error:
        # A class in the making turns what strikes it into a RuntimeError.
        if not isinstance(error.__cause__ or error, KeyboardInterrupt):
            raise
        # A command that has something to say of what comes next raises it with these words.
        words = error.args if isinstance(error, KeyboardInterrupt) else ()
        say("; ".join(["rig: interrupted", *map(str, words)]))
        # Where it struck while a module made a class from text, Python 3.11 would end by the signal
        # in spite of all; text that runs to its end makes it forget.
        exec("")  # noqa: S102
        return INTERRUPTED
    except BrokenPipeError:
        return 0  # whoever read our output has seen enough
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in OPTIONAL:
            raise
        from shlex import quote  # noqa: PLC0415 - never needed otherwise

        say(f"rig: this needs {package}: {quote(sys.executable)} -m pip install {package}")
        return BAD_INPUT
    except OSError as error:
        named = error.strerror and error.filename
        say(f"rig: {error.filename}: {error.strerror}" if named else f"rig: {error}")
        return BAD_INPUT
    return code


@contextmanager
def _put_in_order() -> Iterator[None]:
    """Have Ctrl-C be an exception while a command is at work, however it ends the process else."""
    before = signal.getsignal(signal.SIGINT)
    if not callable(before) or threading.current_thread() is not threading.main_thread():
        yield
        return
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _parser() -> Parser:
    parser = Parser(
        prog="rig",
        usage="rig [-h] [--version] COMMAND ...",
        description="Lab-rig controller for falling-chain and photogate experiments.",
    )
    parser.add_argument("--version", action="version", version=f"rig {__version__}")
    commands = parser.add_subparsers(prog="rig", metavar="COMMAND", help=argparse.SUPPRESS)
    texts: dict[str, str] = {}

    def command(name: str, text: str, module: str = "") -> Parser:
        texts[name] = text
        added = commands.add_parser(name, description=text)
        added.set_defaults(module=module or name)
        return added

    demo = command("demo", "simulate drops of two chains and compare results with the hidden truth")
    demo.value("-o --output", "DIR", "folder for all files (default: out/…)")
    demo.value("--repeats", "N", "drops at each incline (default 1)", type=_count, default=1)
    demo.value("--seed", "N", "of the simulation (default 1)", type=_seed, default=1)
    demo.flag("--open", "always show the report in a browser")

    new = command("new", "ask a few questions, write a protocol, draw it and simulate it")
    new.value("output", "FILE.yaml", "the new protocol", type=_place("protocol.yaml"))
    new.add_argument(
        "--scene",
        choices=("two-chains", "one-chain", "object", "track", "picket-fence"),
        help="what you drop; an object is a ball, a card or a cylinder",
    )
    new.add_argument("--board", choices=(*BOARDS, "other"), help="the timer")
    new.value("--gates", "N", "number of photogates")
    new.value("--rods", "N", "number of rods of a chain or bars of a fence")
    new.value("--length", "L", 'of a chain or a fence, such as "1165 mm"')
    new.value("--diameter", "D", "of a rod; for an object its length in a beam")
    new.add_argument(
        "--aim", choices=("separation", "speed", "coefficients"), help="what to measure"
    )
    new.value("--incline", "A", 'of the board or the track, such as "40 deg, 60 deg"')
    new.value("--drop", "H", 'drop height, such as "180 mm ± 2 mm"')
    new.value("--repeats", "N", "number of drops at each incline")
    new.value("--title", "TEXT", "of the protocol (default: the name of the file)")
    new.flag("--yes", "accept the defaults without questions")

    run = command("run", "run a protocol, or continue it")
    _protocol(run)
    run.add_argument(
        "--port", type=_port, required=True, help="device path or URL; sim:// needs no hardware"
    )
    run.value("--session", "FILE", "a new file, or a session to continue", required=True)
    run.value("--seed", "N", "of a simulation (default 0)", type=_seed)
    run.flag("--yes", "do not wait for Enter; implied without a terminal")
    _json(run)
    run.value("--socket", "PATH", "socket of the daemon (default: the usual place)")

    daemon = command("daemon", "keep a port and its session open for several clients")
    daemon.add_argument("--port", type=_port, required=True, help="device path or URL")
    daemon.value("--socket", "PATH", "socket for clients (default: the usual place)")
    daemon.flag("--tcp", "listen on a port of 127.0.0.1, for programs without Unix sockets")
    daemon.value(
        "--idle-timeout",
        "S",
        "end after so many seconds without a client, if no drop is armed, running or "
        "unsaved (default: run until a signal comes)",
        type=_seconds,
    )

    _tui(command("tui", "run and watch a lab session in the terminal"))

    check = command("check", "check a protocol: its scene, gates, plan and limits")
    _protocol(check, nargs="?")
    check.flag("--keys", "list every key that a protocol accepts")
    check.flag("--schema", "print the keys as a JSON Schema, for editors")
    check.add_argument("--board", choices=tuple(BOARDS), help="report what this board cannot do")
    check.value(
        "-o --output",
        "FILE",
        "draw how to mount the gates (.svg, .png, .pdf)",
        type=_place("mounting.svg"),
    )

    design = command(
        "design", "predict the uncertainties of a gate layout, and propose better heights"
    )
    _protocol(design)
    design.value(
        "-o --output",
        "NEW.yaml",
        "write the protocol with the proposed heights",
        type=_place("proposed.yaml"),
    )
    design.value("--repeats", "N", "drops at each incline", type=_count)
    design.value("--learned", "SESSION", "take the scatter from an earlier session of the same rig")
    design.value("--lowest", "H", 'lowest beam, such as "20 mm" (default: as now)')
    design.value("--highest", "H", "highest beam (default: as now)")
    design.value("--spacing", "D", "least distance of two beams (default 10 mm)")
    design.flag("--no-search", "only predict the layout of the protocol")
    _json(design)

    predict = command("predict", "print the predictions of the model")
    _protocol(predict, nargs="?")
    predict.add_argument(
        "--figure", type=int, choices=(3, 4, 6), help="draw this figure of the paper"
    )
    predict.value(
        "-o --output",
        "FILE.svg",
        "the figure (.svg, .png or .pdf); its numbers go to FILE.csv",
        type=_place("figure.svg"),
    )
    predict.flag("--resolved", "add drops simulated rod by rod (figures 3 and 4)")
    _json(predict)

    _sweep(command("sweep", "map the model's Δz and V over a grid of parameters"))

    imported = command("import", "make a session from the data of another timer", "import_edges")
    imported.value(
        "events",
        "EVENTS",
        "columns run,channel,time_s,state; any other timer's table of times; samples of a "
        "logic analyser or an oscilloscope; a value change dump",
    )
    imported.value("--protocol", "FILE", "the protocol of these drops", required=True)
    imported.value("-o --session", "FILE", "the new session")
    imported.flag("--dry-run", "show how the file is read, without a session")
    imported.value("--channel", "N", "channel of the gate, if the file has one gate", type=int)
    imported.value("--map", "D0=2,D1=5", "channel of each input of the file; also: --map D0=2 D1=5")
    imported.add_argument(
        "--unit",
        choices=("s", "ms", "us", "ns"),
        help="unit of the times, if the file does not state it",
    )
    imported.add_argument(
        "--dark",
        choices=("high", "low", "turns", "turns-clear", "each"),
        help="level of a signal while its beam is blocked; of times alone: beams darken and clear "
        "in turns, clear first, or darken at each",
    )
    imported.value("--map-file", "FILE", "save how the file is read, or use what was saved")
    imported.flag("--as-read", "do not compare the drops with the protocol's falls")
    imported.flag("--allow-unused", "accept rows of which no edge is made")
    imported.add_argument("--list-formats", action=_ListFormats, nargs=0, help="list known formats")
    imported.value(
        "--clock-uncertainty",
        "U",
        'relative standard uncertainty of the timer, such as "50 ppm" (default 0.29 %%: a '
        "ceramic resonator)",
    )
    imported.flag("--simulated", "the edges come from a simulation")

    analyze = command("analyze", "compute the results of a session, or of several together")
    _session(analyze)
    _together(analyze, "*")
    analyze.value("--budget", "RUN", "uncertainty budget of this run", type=_count)
    analyze.value(
        "--trials",
        "M",
        "Monte Carlo trials for the budget (default: until they tell whether both agree, at "
        "most 1600); adaptive: until u has one stable digit",
        type=_trials,
    )
    analyze.value("--session-trials", "M", "Monte Carlo trials of the joint fit", type=_count)
    analyze.flag("--scatter", "SD, SE and U of each mean, and half-SD bars")
    analyze.value("--video", "FILE", "compare with t, x, y of a tracked video of the same drop")
    analyze.flag("--priors", "show how each prior changes the results; takes longer")
    _fresh(analyze)
    _json(analyze)

    compare = command("compare", "compare the means of sessions with those of the first one")
    _session(compare)
    _together(compare, "+")
    compare.value(
        "-o --output",
        "FILE",
        "write the comparison as a page (.html), or its figure (.svg, .png, .pdf)",
        type=_place("comparison.html"),
    )
    _fresh(compare)
    _json(compare)

    estimated = command("estimate", "estimate restitution, friction and impulses from a session")
    _session(estimated)
    estimated.value("-o --output", "DIR", "folder for pictures as SVG files")
    _fresh(estimated)
    _json(estimated)

    report = command("report", "write the results of a session as one HTML page")
    _session(report)
    report.value("-o --output", "FILE", "the page", required=True, type=_place("report.html"))
    report.value("--figures", "DIR", "folder for the figures as SVG files too")
    report.add_argument(
        "--bars",
        choices=["U95", "u", "SE", "SD", "half-SD"],
        default="U95",
        help="meaning of the error bars; half-SD is that of the paper",
    )
    _fresh(report)

    export = command("export", "write a session's results and edges as CSV files")
    _session(export)
    export.value("--csv", "DIR", "folder for the files", required=True)
    _fresh(export)

    recover = command("recover", "list what can be read of a damaged session file, and save it")
    _session(recover)
    recover.value(
        "-o --output",
        "NEW",
        "save all that can be read in a new file",
        type=_place("recovered.session"),
    )
    recover.value("--protocol", "FILE", "the protocol file, if the session has lost it")

    _session(command("unblind", "show the results of a blind session; the session records it"))

    _session(command("replay", "analyse the recorded bytes again and compare the results"))

    flash = command("flash", "write the firmware onto a board and verify it")
    flash.add_argument(
        "--board",
        required=True,
        choices=tuple(FLASHED),
        help="its kind; nano-old: a Nano whose boot loader listens at 57,600 baud only",
    )
    flash.value(
        "--port", "PATH", "its device, such as /dev/ttyACM0; not wanted of a Pico", type=_port
    )
    flash.value("--drive", "DIR", "of a Pico: where its drive is mounted, if not found by itself")
    flash.value(
        "--hex", "FILE", "the firmware, if not the one that comes with this program; UF2 for a Pico"
    )
    flash.value("--avrdude", "PATH", "where avrdude is, if not found by itself")

    ports = command("ports", "list the ports where a board may be; opens none by itself")
    ports.value(
        "--identify",
        "PORT",
        "ask who is there: at these ports, or else at every candidate; opening a port "
        "restarts the board behind it",
        nargs="*",
    )
    _json(ports)

    doctor = command("doctor", "look for what is wrong with this computer, a board or a session")
    doctor.add_argument("--port", type=_port, help="also this board: device path or URL")
    doctor.value("--session", "FILE", "also this session, and its disk")
    doctor.flag("--clear-cache", "forget all kept results")
    _json(doctor)

    selftest = command("selftest", "have a board prove that it does what it must")
    selftest.add_argument("--port", type=_port, required=True, help="device path or URL")
    selftest.value(
        "--loopback",
        "GATE",
        "a wire joins the sync output to this gate: measure how exactly FIRE is stamped",
        type=int,
        choices=range(16),
    )
    selftest.value("--drops", "N", "for that measurement (default 20)", type=_count, default=20)
    selftest.flag(
        "--release", "allow release 0 to be driven, once for 50 ms; without it no release ever is"
    )
    _json(selftest)

    completion = command("completion", "print what a shell reads to complete what is typed")
    completion.add_argument("shell", choices=("bash", "zsh", "fish"), help="which shell")

    bench = command("bench", "error against run time, extremes, and what scenes cost")
    benches = bench.add_subparsers(required=True, metavar="BENCH")
    stability = benches.add_parser("stability", help="the model at the ends of what can be asked")
    stability.set_defaults(module="bench_stability")
    stability.value("-o --output", "DIR", "folder for page, CSV and JSON")
    _json(stability)
    precision = benches.add_parser("precision", help="error against run time of every method")
    precision.set_defaults(module="bench_precision")
    precision.value("-o --output", "DIR", "folder for page, CSV, JSON and pictures", required=True)
    precision.flag("--quick", "a small subset, in seconds")
    _json(precision)
    scenes = benches.add_parser("scenes", help="what each scene loads, takes and evaluates")
    scenes.set_defaults(module="bench_scenes")
    scenes.value("--protocols", "DIR", "ready protocols to be measured too", default="protocols")
    scenes.value("--rounds", "N", "of timing", type=_count, default=9)
    scenes.value("-o --output", "DIR", "folder for page, CSV, JSON and picture")
    _json(scenes)
    parser.epilog = (
        f"{overview(texts)}\n\nExit codes: 0 done, 1 internal error (with a log), 2 bad input, 3 a "
        "run was\nvoid, 4 device trouble, 130 interrupted. rig replay: 1 the results differ."
    )
    return parser


def _tui(tui: Parser) -> None:
    tui.value("protocol", "PROTOCOL", "protocol file (default: choose it on the screen)", nargs="?")
    tui.add_argument(
        "--port",
        type=_port,
        help="device path or URL, such as sim://?pace=1; starts a daemon if none runs. "
        "Without --port: watch the running daemon",
    )
    tui.value(
        "--session", "FILE", "a new file, or a session to continue; alone: show it without a daemon"
    )
    tui.value("--seed", "N", "of a simulation (default 0)", type=_seed)
    tui.value("--socket", "PATH", "socket of the daemon (default: the usual place)")
    tui.value("--keys", "FILE", "your own keys (TOML)")
    tui.flag("--bell", "ring the bell at every verdict")
    tui.flag("--ascii", "use ASCII characters only")


def _sweep(sweep: Parser) -> None:
    _protocol(sweep)
    sweep.value(
        "--vary",
        "NAME=LOW..HIGH:COUNT",
        "an axis, as in restitution=-0.4..0.9:200 or drop=100mm..300mm:50; once for each "
        "axis. NAME=VALUE, as in incline=40deg, holds a parameter at another value than the "
        "protocol's. Where the plan has several inclines and none is given here, each is a layer: "
        "an axis of its own",
        action="append",
        required=True,
    )
    sweep.value(
        "-o --output",
        "FILE",
        "its ending chooses the kind: .csv a row a point; .npz arrays; .svg, .png or .pdf "
        "curves or two maps, of one or two axes at one incline",
        required=True,
        type=_place("sweep.csv"),
    )
    who = sweep.add_mutually_exclusive_group()
    who.add_argument(
        "--jobs", type=_count, metavar="N", help="threads at most (default: one a core)"
    )
    who.add_argument(
        "--cluster",
        metavar="ADDRESS",
        help="compute on a Dask cluster instead, such as tcp://lab-server:8786; its workers need "
        "the same chainrig",
    )


def _count(text: str) -> int:
    try:
        number = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"found '{text}'; accepted: a whole number") from None
    if number < 1:
        raise argparse.ArgumentTypeError(f"found {text}; accepted: 1 or more")
    return number


def _trials(text: str) -> int | str:
    if text == "adaptive":
        return text
    if not text.lstrip("+-").isdecimal():
        raise argparse.ArgumentTypeError(f"found '{text}'; accepted: a whole number or adaptive")
    return _count(text)


def _seed(text: str) -> int:
    if not text.isdecimal() or int(text) >= 2**63:
        raise argparse.ArgumentTypeError(f"found '{text}'; accepted: a whole number from 0 to 2^63")
    return int(text)


def _port(text: str) -> str:
    if not text:
        raise argparse.ArgumentTypeError("no port is named: a device path, or a URL such as sim://")
    return text


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = 0.0
    if not 0.0 < seconds < math.inf:
        raise argparse.ArgumentTypeError(f"found {text!r}; accepted: a time in seconds above 0")
    return seconds


def _place(name: str) -> Callable[[str], str]:
    """Return a reader of a file's place: in a folder it has this name, else at least its ending."""

    def place(text: str) -> str:
        if text.endswith("/") or os.path.isdir(text):  # noqa: PTH112 - pathlib takes 5 ms
            return os.path.join(text, name)  # noqa: PTH118
        named = os.path.splitext(text)[1] or os.path.exists(text)  # noqa: PTH110, PTH122
        return text if named else text + os.path.splitext(name)[1]  # noqa: PTH122

    return place


def _protocol(parser: Parser, nargs: str | None = None) -> None:
    parser.value("protocol", "PROTOCOL", "the protocol file (YAML)", nargs=nargs)


def _session(parser: Parser) -> None:
    parser.value("session", "SESSION", "the session file")


def _fresh(parser: Parser) -> None:
    parser.flag("--fresh", "compute everything again, use no kept results")


def _together(parser: Parser, nargs: str) -> None:
    parser.value("others", "SESSION", "further sessions", nargs=nargs)
    parser.add_argument(
        "--same-rig",
        action=argparse.BooleanOptionalAction,
        help="whether several sessions have the same posts, gates and chains (default: those with "
        "the same title and board, as far as their protocols agree)",
    )
    parser.flag("--unfinished", "add sessions whose plan is not finished too")


def _json(parser: Parser) -> None:
    parser.flag("--json", "print JSON instead of a table")


if __name__ == "__main__":
    sys.exit(main())
