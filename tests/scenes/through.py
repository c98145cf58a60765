"""One scene sent through every command, and all that is wrong with what they say."""

import io
import json
import re
import signal
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from rig import __version__
from rig.analysis.result import GOOD
from rig.cli import main
from rig.doctor import computer
from rig.protocol.protocol import Protocol
from rig.report import canvas
from rig.report.figure import Chart
from rig.report.templates import sentence
from tests.scenes.draw import Scene
from tests.tables import read_table

LONGEST_S = 60.0
"""Processor time of one command, far beyond what any of them needs."""
DONE, BAD_INPUT, VOID = 0, 2, 3
_NO_NUMBER = re.compile(r"(?<![\w.])[-−+]?(?:nan|NaN|inf|Infinity|None)(?!\w)")
_PYTHON = re.compile(
    r"\b[A-Z]\w*\(\w+=|<rig|\bobject at 0x|\b(?:namedtuple|Quantity|array)\(|\bNone\b"
)
"""How Python writes what is no text, in a key or a value."""
_EXPONENT = re.compile(r"±\s*[\d.]+e[+-]?\d+")
_WORDS = read_table(__file__, "words")


class TooLongError(BaseException):
    """A command does not end; no ``except Exception`` of its own may hide that."""


class Done(NamedTuple):
    """How a command ended; `code` is ``None`` where it crashed."""

    code: int | None
    out: str
    err: str


def lacking(protocol: Protocol) -> tuple[str, ...]:
    """Words of what a scene does not have."""
    surface, pair, others = protocol.surface, _WORDS["pair"], _WORDS["others"]
    if surface is None:
        words = [*pair, *_WORDS["impact"], *others[protocol.vocabulary.scene], "pile"]
        of_tracks = () if protocol.track is None else ("inclin", "friction")
        return tuple(word for word in words if word not in of_tracks)
    alone = [] if protocol.two_chains else [*pair, "free side", "free chain"]
    words = *others["free-chain"], *alone
    if all(rods.chain.alpha is not None for rods in protocol.chains.values()):
        return (*words, "restitution", "friction", "pile")
    return (*words, "pile") if surface.pile is None else words


def faults(scene: Scene, folder: Path) -> list[str]:
    """Send a scene through every command.

    Parameters
    ----------
    scene
        The protocol and its simulated rig.
    folder
        An empty one, for files.

    Returns
    -------
    list of str
        What is wrong, a command and a sentence each; empty where all is well.
    """
    journey = _Journey(scene, folder)
    journey.go()
    return journey.faults


@contextmanager
def _ending(seconds: float) -> Iterator[None]:
    def expire(*_: object) -> None:
        raise TooLongError

    before = signal.signal(signal.SIGPROF, expire)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


@contextmanager
def one_file(number: int) -> Iterator[None]:
    """Write one of the first two figures as a file of one kind: all take long to draw.

    All are drawn for the page, and that a figure is written in every kind is for tests/report.
    """
    turns = count()
    with pytest.MonkeyPatch.context() as patch:

        def written(path: Path, figure: Chart) -> None:
            if next(turns) == number % (2 * len(canvas.KINDS)):
                write(path, figure)

        write = canvas.write_figure
        patch.setattr(canvas, "write_figure", written)
        yield


def _not_strict(constant: str) -> float:
    raise ValueError(f"{constant} is no JSON")


class _Journey:
    def __init__(self, scene: Scene, folder: Path) -> None:
        self.scene, self.folder = scene, folder
        self.lacking = lacking(scene.protocol)
        self.faults: list[str] = []
        self.protocol = folder / "scene.yaml"
        self.session = folder / "scene.session"

    def go(self) -> None:
        """Call every command."""
        self.protocol.write_text(self.scene.text, "utf-8")
        checked = self.call("check", self.protocol)
        self.read("check", checked.out.partition("\nLeft out\n")[0])
        self.predicted()
        self.swept()
        if not self.scene.protocol.gates:
            for command in (("run", self.protocol, "--port", self.scene.port, "--session",
                             self.session, "--yes"), ("design", self.protocol)):  # fmt: skip
                self.call(*command, promised=(BAD_INPUT,))
            return
        ran = self.call(
            "run", self.protocol, "--port", self.scene.port, "--session", self.session,
            "--seed", self.scene.seed, "--yes", promised=(DONE, VOID),
        )  # fmt: skip
        if ran.code not in {DONE, VOID}:
            return
        self.read("run", ran.out + ran.err)
        found = self.analyzed(ran)
        if found is None:
            return
        self.estimated(found)
        self.reported(found)
        self.exported()
        self.designed()
        self.replayed()

    def call(self, *arguments: object, promised: Sequence[int] = (DONE,)) -> Done:
        """Call one command; note whatever no command may do."""
        out, err = io.StringIO(), io.StringIO()
        words = [str(argument) for argument in arguments]
        name = " ".join(word.replace(str(self.folder), ".") for word in words)
        try:
            with redirect_stdout(out), redirect_stderr(err), _ending(LONGEST_S):
                code: int | None = main(words)
        except SystemExit as stop:  # argparse's way
            code = int(str(stop.code))
        except TooLongError:
            where = traceback.format_exc().splitlines()[-6:-1]
            self.fault(name, f"does not end: {' '.join(map(str.strip, where))}")
            return Done(None, out.getvalue(), err.getvalue())
        except Exception as error:
            where = traceback.extract_tb(error.__traceback__)[-1]
            place = f"{where.filename.rpartition('/')[2]}:{where.lineno}"
            self.fault(name, f"crashes: {type(error).__name__}: {error} ({place})")
            return Done(None, out.getvalue(), err.getvalue())
        done = Done(code, out.getvalue(), err.getvalue())
        if code not in promised:
            self.fault(name, f"exit code {code}, not one of {promised}: {done.err.strip()[-300:]}")
        if "Traceback" in done.out + done.err:
            self.fault(name, "a traceback")
        if "could not be made" in done.err:
            self.fault(name, done.err.strip())
        plain = () if "--json" in words else (_NO_NUMBER, _EXPONENT)
        for pattern in (_PYTHON, *plain):
            for text in (done.out, done.err):
                if met := pattern.search(text):
                    self.fault(name, f"says {_around(text, met)}")
        return done

    def json(self, *arguments: object, promised: Sequence[int] = (DONE,)) -> Any:
        """Call one command with ``--json``; ``None`` where it fails."""
        done = self.call(*arguments, "--json", promised=promised)
        if done.code not in promised or done.code == BAD_INPUT:
            return None
        try:
            return json.loads(done.out, parse_constant=_not_strict)
        except ValueError as error:
            return self.fault(f"{arguments[0]} --json", str(error))

    def fault(self, command: str, sentence: str) -> None:
        """Note what is wrong."""
        self.faults.append(f"{command}: {sentence}")

    def read(self, command: str, text: str) -> None:
        """Look for what the scene does not have in what a command says."""
        text = text.replace(self.scene.protocol.title, "").replace(
            sentence("software", __version__), ""
        )
        text = re.sub(r"(?m)^  hang  ", "", text)  # the prior's name, as protocols have it
        plan = command in {"check", "predict", "design"} and self.scene.protocol.surface
        for word in (*self.lacking, *(["the object"] if plan else [])):
            if met := re.search(word, text, re.IGNORECASE if len(word) > 3 else re.NOFLAG):
                self.fault(command, f"speaks of {word!r}: {_around(text, met)}")
        if _NO_NUMBER.search(text):
            self.fault(command, f"says {_around(text, _NO_NUMBER.search(text))}")

    def inclines(self, command: str, text: str, inclines: Iterator[float]) -> None:
        """See that every incline is called by its whole number."""
        for incline in inclines:
            if not re.search(rf"(?<![\d.]){re.escape(f'{incline:g}')}(?![\d.])", text):
                self.fault(command, f"does not name {incline:g}°: {text[:200]}")

    def predicted(self) -> None:
        done = self.call("predict", self.protocol)
        self.read("predict", done.out)
        found = self.json("predict", self.protocol)
        if found is None:
            return
        lines = found["predictions"]
        if self.scene.protocol.surface is not None:
            self.inclines("predict", done.out, (line["incline_deg"] for line in lines))
            wanted = list(dict.fromkeys(self.scene.protocol.plan.inclines))
            # Unlike chains strike unlike: each has its own.
            if list(dict.fromkeys(line["incline_deg"] for line in lines)) != wanted:
                self.fault("predict --json", "not a prediction for every incline")

    def swept(self) -> None:
        table = self.folder / "sweep.csv"
        protocol = self.scene.protocol
        struck = protocol.surface is not None
        done = self.call(
            "sweep", self.protocol, "--vary", "drop=50mm..100mm:3", "-o", table, "--jobs", 1,
            promised=(DONE,) if struck and protocol.drag is None else (BAD_INPUT,),
        )  # fmt: skip
        if done.code == DONE and _NO_NUMBER.search(table.read_text("utf-8")):
            self.fault("sweep", "a number that is none in the table")

    def analyzed(self, ran: Done) -> Any:
        assert ran.code is not None
        done = self.call("analyze", self.session, "--scatter", promised=(ran.code,))
        self.read("analyze", done.out)
        if not done.out.startswith(ran.out.rstrip("\n")):
            self.fault("analyze", f"says another thing than run: {ran.out!r} {done.out!r}")
        found = self.json("analyze", self.session, promised=(ran.code,))
        if found is None:
            return None
        if self.scene.protocol.surface is not None:
            lines = (line["incline_deg"] for line in found["summary"])
            self.inclines("analyze", done.out, lines)
        # Of a void run there may be a fit, or none.
        for verdicts, promised in ((GOOD, (DONE,)), (("void",), (DONE, BAD_INPUT))):
            for run in [run for run in found["runs"] if run["verdict"] in verdicts][:1]:
                told = self.call("analyze", self.session, "--budget", run["run"], "--trials", 3,
                                 promised=promised)  # fmt: skip
                self.read("analyze --budget", told.out)
        return found

    def estimated(self, found: Any) -> None:
        told = [
            run
            for run in found["runs"]
            if run["verdict"] in GOOD
            and "not_converged" not in {reason["code"] for reason in run["reason_codes"]}
        ]
        promised = (DONE,) if self.scene.protocol.surface is not None and told else (BAD_INPUT,)
        done = self.call("estimate", self.session, promised=promised)
        if done.code == DONE:
            self.read("estimate", done.out)
        self.json("estimate", self.session, promised=promised)

    def reported(self, found: Any) -> None:
        page = self.folder / "report.html"
        with one_file(self.scene.seed):
            done = self.call(
                "report", self.session, "-o", page, "--figures", self.folder / "figures"
            )
        if done.code != DONE:
            return
        html = page.read_text("utf-8")
        for failed in re.findall(r"[Cc]ould not be (?:made|worked out)[^<]*", html):
            self.fault("report", f"something {failed}")
        said = re.sub(r"<(style|pre|title|h1|svg|dl)\b.*?</\1>", "", html, flags=re.DOTALL)
        text = re.sub(r"<[^>]+>", "\n", said)
        self.read("report", text)
        if met := _EXPONENT.search(text):
            self.fault("report", f"says {_around(text, met)}")
        if self.scene.protocol.surface is not None:
            self.inclines("report", text, (run["incline_deg"] for run in found["runs"]))

    def exported(self) -> None:
        place = self.folder / "csv"
        self.call("export", self.session, "--csv", place)
        for file in place.iterdir():
            text = file.read_text("utf-8")
            if met := _PYTHON.search(text):
                self.fault("export", f"{file.name} says {_around(text, met)}")
            if file.suffix == ".txt":
                self.read("export", text.replace(self.scene.port, ""))
        again = self.folder / "again.session"
        self.call("import", place / "edges.csv", "--protocol", self.protocol, "--session", again,
                  "--simulated", promised=(DONE,))  # fmt: skip
        self.json("analyze", again, promised=(DONE, VOID))

    def designed(self) -> None:
        told = self.call("design", self.protocol, "--no-search")
        self.read("design", told.out)
        self.json("design", self.protocol, "--no-search")

    def replayed(self) -> None:
        """See that the file is whole, and that it gives the same again."""
        done = self.call("replay", self.session)
        if not done.out.rstrip().endswith("identical"):
            self.fault("replay", done.out[-300:])
        self.call("recover", self.session, "-o", self.folder / "recovered.session")
        with pytest.MonkeyPatch.context() as patch:
            # Which packages are installed is no scene's matter, and takes long to list.
            patch.setattr(computer, "check_packages", lambda _: "not looked at")
            self.call("doctor", "--session", self.session)


def _around(text: str, met: re.Match[str] | None) -> str:
    assert met is not None
    return repr(text[max(0, met.start() - 60) : met.end() + 30])
