"""One scene sent through every command, up to the first that is wrong in what it says."""

import json
import re
import signal
from collections.abc import Callable, Container, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Any

import pytest

from rig import __version__
from rig.analysis.result import GOOD
from rig.doctor import computer
from rig.protocol.protocol import Protocol
from rig.report import canvas
from rig.report.figure import Chart
from rig.report.templates import sentence
from tests.programs import Done
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


def see_none(pattern: str | re.Pattern[str], text: str) -> None:
    """See that nothing in a text is as in a pattern."""
    met = re.search(pattern, text)
    assert met is None, f"says {text[max(0, met.start() - 60) : met.end() + 30]!r}"


class Journey:
    """A scene's way through all commands.

    Parameters
    ----------
    call
        Calls a command; see `tests.conftest`.
    scene
        The protocol and its simulated rig.
    folder
        An empty one, for files.
    """

    def __init__(self, call: Callable[..., Done], scene: Scene, folder: Path) -> None:
        self._call, self.scene, self.folder = call, scene, folder
        self.lacking = lacking(scene.protocol)
        self.protocol = folder / "scene.yaml"
        self.session = folder / "scene.session"

    def go(self) -> None:
        """Call every command."""
        self.protocol.write_text(self.scene.text, "utf-8")
        checked = self.call("check", self.protocol)
        self.read(checked.out.partition("\nLeft out\n")[0], plan=True)
        self.predicted()
        self.swept()
        run = ("run", self.protocol, "--port", self.scene.port, "--session", self.session, "--yes")
        if not self.scene.protocol.gates:
            self.call(*run, code=BAD_INPUT)
            self.call("design", self.protocol, code=BAD_INPUT)
            return
        ran = self.call(*run, "--seed", self.scene.seed, code=(DONE, VOID))
        self.read(ran.out + ran.err)
        found = self.analyzed(ran)
        self.estimated(found)
        self.reported(found)
        self.exported()
        self.read(self.call("design", self.protocol, "--no-search").out, plan=True)
        self.json("design", self.protocol, "--no-search")
        self.replayed()

    def call(self, *arguments: object, code: int | Container[int] = DONE) -> Done:
        """Call one command, and see that it does nothing that no command may do."""
        with _ending(LONGEST_S):
            done = self._call(*arguments, code=code)
        plain = () if "--json" in arguments else (_NO_NUMBER, _EXPONENT)
        for pattern in (_PYTHON, *plain):
            see_none(pattern, done.out)
            see_none(pattern, done.err)
        assert "Traceback" not in done.out
        assert "could not be made" not in done.err
        return done

    def json(self, *arguments: object, code: int | Container[int] = DONE) -> Any:
        """Call one command with ``--json``; ``None`` where it has nothing to say."""
        done = self.call(*arguments, "--json", code=code)
        return None if done.code == BAD_INPUT else json.loads(done.out, parse_constant=pytest.fail)

    def read(self, text: str, plan: bool = False) -> None:
        """Look for what the scene does not have in what a command says, be it of a plan alone."""
        text = text.replace(self.scene.protocol.title, "")
        text = text.replace(sentence("software", __version__), "")
        text = re.sub(r"(?m)^  hang  ", "", text)  # the prior's name, as protocols have it
        only = ["the object"] if plan and self.scene.protocol.surface else []
        for word in (*self.lacking, *only):
            see_none(re.compile(word, re.IGNORECASE if len(word) > 3 else re.NOFLAG), text)
        see_none(_NO_NUMBER, text)

    def inclines(self, text: str, lines: list[dict[str, Any]]) -> None:
        """See that every incline is called by its whole number, where there is one."""
        for line in lines if self.scene.protocol.surface is not None else ():
            incline = re.escape(f"{line['incline_deg']:g}")
            assert re.search(rf"(?<![\d.]){incline}(?![\d.])", text), text[:200]

    def predicted(self) -> None:
        done = self.call("predict", self.protocol)
        self.read(done.out, plan=True)
        lines = self.json("predict", self.protocol)["predictions"]
        self.inclines(done.out, lines)
        if self.scene.protocol.surface is not None:
            # Unlike chains strike unlike: each has its own.
            wanted = dict.fromkeys(self.scene.protocol.plan.inclines)
            assert [*dict.fromkeys(line["incline_deg"] for line in lines)] == [*wanted]

    def swept(self) -> None:
        table = self.folder / "sweep.csv"
        protocol = self.scene.protocol
        can_be = protocol.surface is not None and protocol.drag is None
        words = ("sweep", self.protocol, "--vary", "drop=50mm..100mm:3", "-o", table, "--jobs", 1)
        self.call(*words, code=DONE if can_be else BAD_INPUT)
        if can_be:
            see_none(_NO_NUMBER, table.read_text("utf-8"))

    def analyzed(self, ran: Done) -> Any:
        done = self.call("analyze", self.session, "--scatter", code=ran.code)
        self.read(done.out)
        assert done.out.startswith(ran.out.rstrip("\n"))
        found = self.json("analyze", self.session, code=ran.code)
        self.inclines(done.out, found["summary"])
        # Of a void run there may be a fit, or none.
        for verdicts, code in ((GOOD, DONE), (("void",), (DONE, BAD_INPUT))):
            for run in [run for run in found["runs"] if run["verdict"] in verdicts][:1]:
                words = ("analyze", self.session, "--budget", run["run"], "--trials", 3)
                self.read(self.call(*words, code=code).out)
        return found

    def estimated(self, found: Any) -> None:
        told = [
            run
            for run in found["runs"]
            if run["verdict"] in GOOD
            and "not_converged" not in {reason["code"] for reason in run["reason_codes"]}
        ]
        code = DONE if self.scene.protocol.surface is not None and told else BAD_INPUT
        self.read(self.call("estimate", self.session, code=code).out)
        self.json("estimate", self.session, code=code)

    def reported(self, found: Any) -> None:
        page = self.folder / "report.html"
        with one_file(self.scene.seed):
            self.call("report", self.session, "-o", page, "--figures", self.folder / "figures")
        html = page.read_text("utf-8")
        see_none(r"[Cc]ould not be (?:made|worked out)", html)
        said = re.sub(r"<(style|pre|title|h1|svg|dl)\b.*?</\1>", "", html, flags=re.DOTALL)
        text = re.sub(r"<[^>]+>", "\n", said)
        self.read(text)
        see_none(_EXPONENT, text)
        self.inclines(text, found["runs"])

    def exported(self) -> None:
        place, again = self.folder / "csv", self.folder / "again.session"
        self.call("export", self.session, "--csv", place)
        for file in place.iterdir():
            see_none(_PYTHON, file.read_text("utf-8"))
        self.read((place / "README.txt").read_text("utf-8").replace(self.scene.port, ""))
        files = (place / "edges.csv", "--protocol", self.protocol, "--session", again)
        self.call("import", *files, "--simulated")
        self.json("analyze", again, code=(DONE, VOID))

    def replayed(self) -> None:
        """See that the file is whole, and that it gives the same again."""
        assert self.call("replay", self.session).out.rstrip().endswith("identical")
        self.call("recover", self.session, "-o", self.folder / "recovered.session")
        with pytest.MonkeyPatch.context() as patch:
            # Which packages are installed is no scene's matter, and takes long to list.
            patch.setattr(computer, "check_packages", lambda _: "not looked at")
            self.call("doctor", "--session", self.session)
