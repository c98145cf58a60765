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
OPTIONAL = {"distributed": "distributed", "minisign": "py-minisign", "mpmath": "mpmath"}
"""Modules that few need, and the packages that bring them: for clusters, signatures, 50 digits."""


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

        brings = OPTIONAL[package]
        say(f"rig: this needs {package}: {quote(sys.executable)} -m pip install {brings}")
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

    demo = command("demo", "simulate drops of two chains and compare results with the hidden truth")
    demo.add_argument("-o", "--output", metavar="DIR", help="folder for all files (default: out/…)")
    demo.add_argument(
        "--repeats", type=_count, default=1, metavar="N", help="drops at each incline (default 1)"
    )
    demo.add_argument(
        "--seed", type=_seed, default=1, metavar="N", help="of the simulation (default 1)"
    )
    demo.add_argument("--open", action="store_true", help="always show the report in a browser")

    new = command("new", "ask a few questions, write a protocol, draw it and simulate it")
    new.add_argument(
        "output", type=_place("protocol.yaml"), metavar="FILE.yaml", help="the new protocol"
    )
    new.add_argument(
        "--scene",
        choices=("two-chains", "one-chain", "object", "track", "picket-fence"),
        help="what you drop; an object is a ball, a card or a cylinder",
    )
    new.add_argument("--board", choices=(*BOARDS, "other"), help="the timer")
    new.add_argument("--gates", metavar="N", help="number of photogates")
    new.add_argument("--rods", metavar="N", help="number of rods of a chain or bars of a fence")
    new.add_argument("--length", metavar="L", help='of a chain or a fence, such as "1165 mm"')
    new.add_argument("--diameter", metavar="D", help="of a rod; for an object its length in a beam")
    new.add_argument(
        "--aim", choices=("separation", "speed", "coefficients"), help="what to measure"
    )
    new.add_argument(
        "--incline", metavar="A", help='of the board or the track, such as "40 deg, 60 deg"'
    )
    new.add_argument("--drop", metavar="H", help='drop height, such as "180 mm ± 2 mm"')
    new.add_argument("--repeats", metavar="N", help="number of drops at each incline")
    new.add_argument(
        "--title", metavar="TEXT", help="of the protocol (default: the name of the file)"
    )
    new.add_argument("--yes", action="store_true", help="accept the defaults without questions")

    run = command("run", "run a protocol, or continue it")
    _protocol(run)
    run.add_argument(
        "--port", type=_port, required=True, help="device path or URL; sim:// needs no hardware"
    )
    run.add_argument(
        "--session", required=True, metavar="FILE", help="a new file, or a session to continue"
    )
    run.add_argument("--seed", type=_seed, metavar="N", help="of a simulation (default 0)")
    run.add_argument(
        "--yes", action="store_true", help="do not wait for Enter; implied without a terminal"
    )
    _json(run)
    run.add_argument(
        "--socket", metavar="PATH", help="socket of the daemon (default: the usual place)"
    )

    daemon = command("daemon", "keep a port and its session open for several clients")
    daemon.add_argument("--port", type=_port, required=True, help="device path or URL")
    daemon.add_argument(
        "--socket", metavar="PATH", help="socket for clients (default: the usual place)"
    )
    daemon.add_argument(
        "--tcp",
        action="store_true",
        help="listen on a port of 127.0.0.1, for programs without Unix sockets",
    )
    daemon.add_argument(
        "--idle-timeout",
        type=_seconds,
        metavar="S",
        help="end after so many seconds without a client, if no drop is armed, running or "
        "unsaved (default: run until a signal comes)",
    )

    _tui(command("tui", "run and watch a lab session in the terminal"))

    check = command("check", "check a protocol: its scene, gates, plan and limits")
    _protocol(check, nargs="?")
    check.add_argument("--keys", action="store_true", help="list every key that a protocol accepts")
    check.add_argument(
        "--schema", action="store_true", help="print the keys as a JSON Schema, for editors"
    )
    check.add_argument("--board", choices=tuple(BOARDS), help="report what this board cannot do")
    check.add_argument(
        "-o",
        "--output",
        type=_place("mounting.svg"),
        metavar="FILE",
        help="draw how to mount the gates (.svg, .png, .pdf)",
    )

    design = command(
        "design", "predict the uncertainties of a gate layout, and propose better heights"
    )
    _protocol(design)
    design.add_argument(
        "-o",
        "--output",
        type=_place("proposed.yaml"),
        metavar="NEW.yaml",
        help="write the protocol with the proposed heights",
    )
    design.add_argument("--repeats", type=_count, metavar="N", help="drops at each incline")
    design.add_argument(
        "--learned",
        metavar="SESSION",
        help="take the scatter from an earlier session of the same rig",
    )
    design.add_argument(
        "--lowest", metavar="H", help='lowest beam, such as "20 mm" (default: as now)'
    )
    design.add_argument("--highest", metavar="H", help="highest beam (default: as now)")
    design.add_argument(
        "--spacing", metavar="D", help="least distance of two beams (default 10 mm)"
    )
    design.add_argument(
        "--no-search", action="store_true", help="only predict the layout of the protocol"
    )
    _json(design)

    predict = command("predict", "print the predictions of the model")
    predict.add_argument("protocol", nargs="?", metavar="PROTOCOL", help="the protocol file (YAML)")
    predict.add_argument(
        "--figure", type=int, choices=(3, 4, 6), help="draw this figure of the paper"
    )
    predict.add_argument(
        "-o",
        "--output",
        type=_place("figure.svg"),
        metavar="FILE.svg",
        help="the figure (.svg, .png or .pdf); its numbers go to FILE.csv",
    )
    predict.add_argument(
        "--resolved",
        action="store_true",
        help="add drops simulated rod by rod (figures 3 and 4)",
    )
    _json(predict)

    _sweep(command("sweep", "map the model's Δz and V over a grid of parameters"))

    imported = command("import", "make a session from the data of another timer", "import_edges")
    imported.add_argument(
        "events",
        metavar="EVENTS",
        help="columns run,channel,time_s,state; any other timer's table of times; samples of a "
        "logic analyser or an oscilloscope; a value change dump",
    )
    imported.add_argument(
        "--protocol", required=True, metavar="FILE", help="the protocol of these drops"
    )
    imported.add_argument("-o", "--session", metavar="FILE", help="the new session")
    imported.add_argument(
        "--dry-run", action="store_true", help="show how the file is read, without a session"
    )
    imported.add_argument(
        "--channel", type=int, metavar="N", help="channel of the gate, if the file has one gate"
    )
    imported.add_argument(
        "--map",
        metavar="D0=2,D1=5",
        help="channel of each input of the file; also: --map D0=2 D1=5",
    )
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
    imported.add_argument(
        "--map-file", metavar="FILE", help="save how the file is read, or use what was saved"
    )
    imported.add_argument(
        "--as-read", action="store_true", help="do not compare the drops with the protocol's falls"
    )
    imported.add_argument(
        "--allow-unused", action="store_true", help="accept rows of which no edge is made"
    )
    imported.add_argument("--list-formats", action=_ListFormats, nargs=0, help="list known formats")
    imported.add_argument(
        "--clock-uncertainty",
        metavar="U",
        help='relative standard uncertainty of the timer, such as "50 ppm" (default 0.29 %%: a '
        "ceramic resonator)",
    )
    imported.add_argument(
        "--simulated", action="store_true", help="the edges come from a simulation"
    )

    analyze = command("analyze", "compute the results of a session, or of several together")
    _session(analyze)
    _together(analyze, "*")
    analyze.add_argument(
        "--budget", type=_count, metavar="RUN", help="uncertainty budget of this run"
    )
    analyze.add_argument(
        "--trials",
        type=_trials,
        metavar="M",
        help="Monte Carlo trials for the budget (default: until they tell whether both agree, at "
        "most 1600); adaptive: until u has one stable digit",
    )
    analyze.add_argument(
        "--session-trials", type=_count, metavar="M", help="Monte Carlo trials of the joint fit"
    )
    analyze.add_argument(
        "--scatter", action="store_true", help="SD, SE and U of each mean, and half-SD bars"
    )
    analyze.add_argument(
        "--video", metavar="FILE", help="compare with t, x, y of a tracked video of the same drop"
    )
    analyze.add_argument(
        "--priors",
        action="store_true",
        help="show how each prior changes the results; takes longer",
    )
    _fresh(analyze)
    _json(analyze)

    compare = command("compare", "compare the means of sessions with those of the first one")
    _session(compare)
    _together(compare, "+")
    compare.add_argument(
        "-o",
        "--output",
        type=_place("comparison.html"),
        metavar="FILE",
        help="write the comparison as a page (.html), or its figure (.svg, .png, .pdf)",
    )
    _json(compare)

    estimated = command("estimate", "estimate restitution, friction and impulses from a session")
    _session(estimated)
    estimated.add_argument("-o", "--output", metavar="DIR", help="folder for pictures as SVG files")
    _fresh(estimated)
    _json(estimated)

    report = command("report", "write the results of a session as one HTML page")
    _session(report)
    report.add_argument(
        "-o", "--output", required=True, type=_place("report.html"), metavar="FILE", help="the page"
    )
    report.add_argument("--figures", metavar="DIR", help="folder for the figures as SVG files too")
    report.add_argument(
        "--bars", choices=["U95", "u", "SE", "SD", "half-SD"], default="U95",
        help="meaning of the error bars; half-SD is that of the paper",
    )  # fmt: skip
    _fresh(report)

    export = command("export", "write a session as CSV files, or as a bundle that can be verified")
    _session(export)
    form = export.add_mutually_exclusive_group(required=True)
    form.add_argument("--csv", metavar="DIR", help="folder for the files")
    form.add_argument(
        "--bundle",
        type=_place("record.eln"),
        metavar="FILE.eln",
        help="RO-Crate with session, report, tables, figures, versions and hashes",
    )
    export.add_argument(
        "--sign", metavar="KEY", help="sign the bundle with this secret key (minisign)"
    )
    _fresh(export)

    notes = command("notes", "add a note to a recorded run")
    _session(notes)
    notes.add_argument("text", metavar="TEXT", help="the note")
    notes.add_argument("--run", type=_count, required=True, metavar="N", help="number of the run")

    attach = command("attach", "add a file, such as a photograph, to a session")
    _session(attach)
    attach.add_argument("file", metavar="FILE", help="the file")

    verify = command("verify", "check a bundle, and derive its numbers again from the raw edges")
    verify.add_argument("file", metavar="FILE", help="bundle, its unpacked folder, or session file")
    verify.add_argument("--key", metavar="KEY.pub", help="public key of who signed it (minisign)")

    recover = command("recover", "list what can be read of a damaged session file, and save it")
    _session(recover)
    recover.add_argument(
        "-o",
        "--output",
        type=_place("recovered.session"),
        metavar="NEW",
        help="save all that can be read in a new file",
    )
    recover.add_argument(
        "--protocol", metavar="FILE", help="the protocol file, if the session has lost it"
    )

    _session(command("unblind", "show the results of a blind session; the session records it"))

    _session(command("replay", "analyse the recorded bytes again and compare the results"))

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
    doctor.add_argument("--clear-cache", action="store_true", help="forget all kept results")
    _json(doctor)

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
    _json(selftest)

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
    parser.epilog = (
        f"{overview(texts)}\n\nExit codes: 0 done, 1 internal error (with a log), 2 bad input, 3 a "
        "run was\nvoid, 4 device trouble, 130 interrupted. rig replay: 1 the results differ."
    )
    return parser


def _tui(tui: argparse.ArgumentParser) -> None:
    tui.add_argument(
        "protocol",
        nargs="?",
        metavar="PROTOCOL",
        help="protocol file (default: choose it on the screen)",
    )
    tui.add_argument(
        "--port",
        type=_port,
        help="device path or URL, such as sim://?pace=1; starts a daemon if none runs. "
        "Without --port: watch the running daemon",
    )
    tui.add_argument(
        "--session",
        metavar="FILE",
        help="a new file, or a session to continue; alone: show it without a daemon",
    )
    tui.add_argument("--seed", type=_seed, metavar="N", help="of a simulation (default 0)")
    tui.add_argument(
        "--socket", metavar="PATH", help="socket of the daemon (default: the usual place)"
    )
    tui.add_argument("--keys", metavar="FILE", help="your own keys (TOML)")
    tui.add_argument("--bell", action="store_true", help="ring the bell at every verdict")
    tui.add_argument("--ascii", action="store_true", help="use ASCII characters only")


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
        type=_place("sweep.csv"),
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


def _protocol(parser: argparse.ArgumentParser, nargs: str | None = None) -> None:
    parser.add_argument(
        "protocol", metavar="PROTOCOL", nargs=nargs, help="the protocol file (YAML)"
    )


def _session(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("session", metavar="SESSION", help="the session file")


def _fresh(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--fresh", action="store_true", help="compute everything again, use no kept results"
    )


def _together(parser: argparse.ArgumentParser, nargs: str) -> None:
    parser.add_argument("others", metavar="SESSION", nargs=nargs, help="further sessions")
    parser.add_argument(
        "--same-rig",
        action=argparse.BooleanOptionalAction,
        help="whether several sessions have the same posts, gates and chains (default: those with "
        "the same title and board, as far as their protocols agree)",
    )
    parser.add_argument(
        "--unfinished", action="store_true", help="add sessions whose plan is not finished too"
    )


def _json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")


if __name__ == "__main__":
    sys.exit(main())
