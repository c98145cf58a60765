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
from rig.command_help import Parser, overview
from rig.errors import RigError
from rig.streams import open_streams, say, settle_streams

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

BAD_INPUT = 2
INTERRUPTED = 130
OPTIONAL = ("distributed", "mpmath")
"""Packages that few need: clusters for `rig sweep`, 50 digits for some of `rig bench`."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    0 done, 2 bad input, 3 a run was void, 4 device trouble, 130 interrupted; 1 comes from
    `rig.__main__`, after an exception that is raised here. Results go to stdout, everything else to
    stderr.
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
        say(str(error))
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

    def command(name: str, text: str, module: str = "") -> argparse.ArgumentParser:
        texts[name] = text
        added = commands.add_parser(name, description=text)
        added.set_defaults(module=module or name)
        return added

    demo = command("demo", "drop chains in simulation, and compare with the truth it hides")
    demo.add_argument("-o", "--output", metavar="DIR", help="folder for all files (default: out/…)")
    demo.add_argument(
        "--repeats", type=_count, default=1, metavar="N", help="drops at each incline (default 1)"
    )
    demo.add_argument(
        "--seed", type=_seed, default=1, metavar="N", help="of the chains (default 1)"
    )
    demo.add_argument("--open", action="store_true", help="show the report in a browser anyway")

    new = command("new", "write a protocol from a few answers, draw it, and try it")
    new.add_argument("output", metavar="FILE.yaml", help="the new protocol")
    new.add_argument(
        "--scene",
        choices=("two-chains", "one-chain", "object", "track", "picket-fence"),
        help="what falls; an object is a ball, a card, a cylinder",
    )
    new.add_argument("--board", choices=(*BOARDS, "other"), help="the timer")
    new.add_argument("--gates", metavar="N", help="how many photogates there are")
    new.add_argument("--rods", metavar="N", help="of a chain, or bars of a fence")
    new.add_argument("--length", metavar="L", help='of a chain or a fence, as "1165 mm"')
    new.add_argument("--diameter", metavar="D", help="of a rod; of an object its length in a beam")
    new.add_argument("--aim", choices=("separation", "coefficients"), help="what is to be learned")
    new.add_argument("--incline", metavar="A", help='of board or track, as "40 deg, 60 deg"')
    new.add_argument("--drop", metavar="H", help='as "180 mm ± 2 mm"')
    new.add_argument("--repeats", metavar="N", help="drops of a kind")
    new.add_argument("--title", metavar="TEXT", help="of the protocol (default: the file's name)")
    new.add_argument(
        "--yes", action="store_true", help="ask nothing: the usual answer for the rest"
    )

    run = command("run", "carry out a protocol, or what is left of it")
    _protocol(run)
    run.add_argument(
        "--port", type=_port, required=True, help="device path or URL; sim:// needs no hardware"
    )
    run.add_argument(
        "--session", required=True, metavar="FILE", help="a new file, or one to be continued"
    )
    run.add_argument("--seed", type=_seed, metavar="N", help="of a simulation (default 0)")
    run.add_argument(
        "--yes", action="store_true", help="answer every prompt; implied when nobody can answer"
    )
    _json(run)
    run.add_argument("--socket", metavar="PATH", help="of the daemon to ask, if not the usual one")

    daemon = command("daemon", "own a port and its session, and serve clients, until stopped")
    daemon.add_argument("--port", type=_port, required=True, help="device path or URL")
    daemon.add_argument("--socket", metavar="PATH", help="where clients come, if elsewhere")
    daemon.add_argument(
        "--tcp",
        action="store_true",
        help="listen on a port of 127.0.0.1, for programs that know no Unix sockets",
    )
    daemon.add_argument(
        "--idle-timeout",
        type=_seconds,
        metavar="S",
        help="end after so many seconds without a client, once nothing is armed, falling or "
        "unsaved (default: stay until a signal comes)",
    )

    _tui(command("tui", "the lab session in the terminal: protocol, gates, runs, results"))

    check = command("check", "say what a protocol's scene has and what follows from it")
    _protocol(check, nargs="?")
    check.add_argument(
        "--keys", action="store_true", help="say what any protocol may say: every key"
    )
    check.add_argument(
        "--schema", action="store_true", help="the same as a JSON Schema, for editors"
    )
    check.add_argument("--board", choices=tuple(BOARDS), help="refuse what this kind cannot do")
    check.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="also draw where the gates are mounted (.svg, .png, .pdf)",
    )

    design = command("design", "predict what a gate layout will tell, and propose better heights")
    _protocol(design)
    design.add_argument(
        "-o", "--output", metavar="NEW.yaml", help="write the protocol with the proposed heights"
    )
    design.add_argument("--repeats", type=_count, metavar="N", help="drops at each incline")
    design.add_argument(
        "--learned", metavar="SESSION", help="scatter as an earlier session of the rig taught it"
    )
    design.add_argument("--lowest", metavar="H", help='of a beam, as "20 mm" (default: as now)')
    design.add_argument("--highest", metavar="H", help="of a beam (default: as now)")
    design.add_argument("--spacing", metavar="D", help="of two beams of a side (default 10 mm)")
    design.add_argument(
        "--no-search", action="store_true", help="only what the protocol's own heights tell"
    )
    _json(design)

    predict = command("predict", "say what the model expects")
    predict.add_argument("protocol", nargs="?", metavar="PROTOCOL", help="the protocol file (YAML)")
    predict.add_argument(
        "--figure", type=int, choices=(3, 4, 6), help="draw this figure of the paper instead"
    )
    predict.add_argument(
        "-o",
        "--output",
        metavar="FILE.svg",
        help="the figure, or .png or .pdf; its numbers go to FILE.csv",
    )
    predict.add_argument(
        "--resolved",
        action="store_true",
        help="with it, what rods that fall resolved in time give (figures 3 and 4)",
    )
    _json(predict)

    _sweep(command("sweep", "map the model's Δz and V over a grid of parameters"))

    imported = command("import", "make a session from the edges of another timer", "import_edges")
    imported.add_argument(
        "events",
        metavar="EVENTS",
        help="columns run,channel,time_s,state; any other timer's table of times; samples of a "
        "logic analyser or an oscilloscope; a value change dump",
    )
    imported.add_argument("--protocol", required=True, metavar="FILE", help="what was dropped")
    imported.add_argument("--session", metavar="FILE", help="the new session")
    imported.add_argument(
        "--dry-run", action="store_true", help="say what is understood, and make nothing"
    )
    imported.add_argument(
        "--channel", type=int, metavar="N", help="of the gate that all times of a file are of"
    )
    imported.add_argument(
        "--map", metavar="D0=2,D1=5", help="which input of the file is the gate at which channel"
    )
    imported.add_argument(
        "--unit", choices=("s", "ms", "us", "ns"), help="of times, where the file does not say"
    )
    imported.add_argument(
        "--dark", choices=("high", "low"), help="level of a signal while its beam is blocked"
    )
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
    analyze.add_argument(
        "--budget", type=_count, metavar="RUN", help="what one run's uncertainty is made of"
    )
    analyze.add_argument(
        "--trials",
        type=_trials,
        metavar="M",
        help="Monte Carlo trials beside it (default: until they tell whether both agree, at most "
        "1600), or adaptive: as many as u to one digit needs",
    )
    analyze.add_argument(
        "--session-trials", type=_count, metavar="M", help="Monte Carlo of the session's joint fit"
    )
    analyze.add_argument(
        "--scatter", action="store_true", help="SD, SE and U of each incline, and half-SD bars"
    )
    analyze.add_argument(
        "--video", metavar="FILE", help="t, x, y of a tracked video of the same fall, as a check"
    )
    analyze.add_argument(
        "--priors", action="store_true", help="how results move with each prior: takes longer"
    )
    _json(analyze)

    estimated = command("estimate", "estimate restitution, friction and impulses from a session")
    _session(estimated)
    estimated.add_argument("-o", "--output", metavar="DIR", help="folder for pictures as SVG files")
    _json(estimated)

    report = command("report", "write the results of a session as one HTML page")
    _session(report)
    report.add_argument("-o", "--output", required=True, metavar="FILE", help="the page")
    report.add_argument("--figures", metavar="DIR", help="folder for the figures as SVG files too")
    report.add_argument(
        "--bars", choices=["U95", "u", "SE", "SD", "half-SD"], default="U95",
        help="what the bars on means stand for; half-SD is what the paper draws",
    )  # fmt: skip

    export = command("export", "write a session's results and edges as CSV files")
    _session(export)
    export.add_argument("--csv", required=True, metavar="DIR", help="folder for the files")

    recover = command("recover", "say what is whole in a session file, which stays as it is")
    _session(recover)
    recover.add_argument("-o", "--output", metavar="NEW", help="save all that can be read there")
    recover.add_argument(
        "--protocol", metavar="FILE", help="the protocol file, where the session has lost it"
    )

    _session(command("unblind", "show a blind session's numbers from now on; recorded in it, once"))

    _session(command("replay", "feed the recorded bytes through the whole stack and compare"))

    flash = command("flash", "write the firmware onto a board and verify it")
    flash.add_argument(
        "--board",
        required=True,
        choices=tuple(FLASHED),
        help="its kind; nano-old: a Nano whose boot loader listens at 57,600 baud only",
    )
    flash.add_argument(
        "--port",
        type=_port,
        metavar="PATH",
        help="its device, such as /dev/ttyACM0; not wanted of a Pico",
    )
    flash.add_argument(
        "--drive",
        metavar="DIR",
        help="of a Pico: where its drive is mounted, if not found by itself",
    )
    flash.add_argument(
        "--hex", metavar="FILE",
        help="the firmware, if not the one that comes with this program; UF2 for a Pico",
    )  # fmt: skip
    flash.add_argument("--avrdude", metavar="PATH", help="where avrdude is, if not found by itself")

    ports = command("ports", "list the ports where a board may be; opens none by itself")
    ports.add_argument(
        "--identify",
        nargs="*",
        metavar="PORT",
        help="ask who is there: at these ports, or else at every candidate; opening a port "
        "restarts the board behind it",
    )
    _json(ports)

    doctor = command("doctor", "look for what is wrong with this computer, a board or a session")
    doctor.add_argument("--port", type=_port, help="also this board: device path or URL")
    doctor.add_argument("--session", metavar="FILE", help="also this session, and its disk")

    selftest = command("selftest", "have a board prove that it does what it must")
    selftest.add_argument("--port", type=_port, required=True, help="device path or URL")
    selftest.add_argument(
        "--loopback",
        type=int,
        choices=range(16),
        metavar="GATE",
        help="a wire joins the sync output to this gate: measure how exactly FIRE is stamped",
    )
    selftest.add_argument(
        "--drops", type=_count, default=20, metavar="N", help="for that measurement (default 20)"
    )
    selftest.add_argument(
        "--release",
        action="store_true",
        help="allow release 0 to be driven, once for 50 ms; without it no release ever is",
    )

    completion = command("completion", "print what a shell reads to complete what is typed")
    completion.add_argument("shell", choices=("bash", "zsh", "fish"), help="which shell")

    bench = command("bench", "error against run time, extremes, and what scenes cost")
    benches = bench.add_subparsers(required=True, metavar="BENCH")
    stability = benches.add_parser("stability", help="the model at the ends of what can be asked")
    stability.set_defaults(module="bench_stability")
    stability.add_argument("-o", "--output", metavar="DIR", help="folder for page, CSV and JSON")
    _json(stability)
    precision = benches.add_parser("precision", help="error against run time of every method")
    precision.set_defaults(module="bench_precision")
    precision.add_argument(
        "-o",
        "--output",
        required=True,
        metavar="DIR",
        help="folder for page, CSV, JSON and pictures",
    )
    precision.add_argument("--quick", action="store_true", help="a small subset, in seconds")
    _json(precision)
    scenes = benches.add_parser("scenes", help="what each scene loads, takes and evaluates")
    scenes.set_defaults(module="bench_scenes")
    scenes.add_argument(
        "--protocols", default="protocols", metavar="DIR", help="ready protocols to be measured too"
    )
    scenes.add_argument("--rounds", type=_count, default=9, metavar="N", help="of timing")
    scenes.add_argument(
        "-o", "--output", metavar="DIR", help="folder for page, CSV, JSON and picture"
    )
    _json(scenes)
    codes = "0 done, 2 bad input, 3 a run was void, 4 device trouble, 130 interrupted"
    parser.epilog = f"{overview(texts)}\n\nExit codes: {codes}."
    return parser


def _tui(tui: argparse.ArgumentParser) -> None:
    tui.add_argument("protocol", nargs="?", metavar="PROTOCOL", help="else to be picked there")
    tui.add_argument(
        "--port",
        type=_port,
        help="device path or URL, such as sim://?pace=1; its daemon is started if none runs. "
        "Without it, the daemon that runs is watched",
    )
    tui.add_argument(
        "--session",
        metavar="FILE",
        help="a new file, or one to be continued; alone: to be looked at, without a daemon",
    )
    tui.add_argument("--seed", type=_seed, metavar="N", help="of a simulation (default 0)")
    tui.add_argument("--socket", metavar="PATH", help="of the daemon, if not the usual one")
    tui.add_argument("--keys", metavar="FILE", help="your own keys (TOML)")
    tui.add_argument("--bell", action="store_true", help="ring at every verdict")
    tui.add_argument(
        "--ascii", action="store_true", help="only characters that every terminal and font has"
    )
    tui.add_argument("--pictures", metavar="DIR", help="write all pages of --session as SVG files")


def _sweep(sweep: argparse.ArgumentParser) -> None:
    _protocol(sweep)
    sweep.add_argument(
        "--vary",
        action="append",
        required=True,
        metavar="NAME=LOW..HIGH:COUNT",
        help="an axis, as in restitution=-0.4..0.9:200 or drop=100mm..300mm:50; once for each "
        "axis. NAME=VALUE, as in incline=40deg, holds a parameter at another value than the "
        "protocol's. Where the plan has several inclines and none is given here, each is a layer: "
        "an axis of its own",
    )
    sweep.add_argument(
        "-o",
        "--output",
        required=True,
        metavar="FILE",
        help="its ending chooses the kind: .csv a row a point; .npz arrays; .svg, .png or .pdf "
        "curves or two maps, of one or two axes at one incline",
    )
    who = sweep.add_mutually_exclusive_group()
    who.add_argument(
        "--jobs", type=_count, metavar="N", help="processes at most (default: one a core)"
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
        raise argparse.ArgumentTypeError(f"found '{text}', not a whole number") from None
    if number < 1:
        raise argparse.ArgumentTypeError(f"{text} is too few: at least 1 is needed")
    return number


def _trials(text: str) -> int | str:
    if text == "adaptive":
        return text
    if not text.lstrip("+-").isdecimal():
        raise argparse.ArgumentTypeError(f"found '{text}', neither a whole number nor adaptive")
    return _count(text)


def _seed(text: str) -> int:
    if not text.isdecimal() or int(text) >= 2**63:
        raise argparse.ArgumentTypeError(f"found '{text}', not a whole number from 0 to 2^63")
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
        raise argparse.ArgumentTypeError(f"{text!r} is not a time in seconds, more than 0")
    return seconds


def _protocol(parser: argparse.ArgumentParser, nargs: str | None = None) -> None:
    parser.add_argument(
        "protocol", metavar="PROTOCOL", nargs=nargs, help="the protocol file (YAML)"
    )


def _session(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("session", metavar="SESSION", help="the session file")


def _json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")


if __name__ == "__main__":
    sys.exit(main())
