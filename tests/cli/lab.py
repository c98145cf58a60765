"""What the tests of the command line share: short protocols, and what a session must look like."""

import io
import json
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

from rig.cli import main
from rig.link.frames import Decoder, Frame
from rig.replay import replay
from rig.session.schema import RunState
from rig.session.store import Session
from tests.programs import Done, end
from tests.tables import protocol_text
from tests.waiting import PATIENCE_S

ROOT = Path(__file__).parents[2]
PROTOCOLS = ROOT / "protocols"
GOOD = {RunState.ACCEPTED, RunState.MARGINAL}

_SHORT = protocol_text("short-campaign")


class Terminal(io.StringIO):
    """A stream at which somebody looks."""

    encoding = "utf-8"

    def isatty(self) -> bool:
        return True


def short(inclines: str = "[40 deg, 60 deg]", repeats: int = 2, settle: str = "1 s") -> str:
    """Write a protocol of the two-chain experiment with few runs."""
    text = _SHORT.replace("INCLINES", inclines).replace("REPEATS", str(repeats))
    return text.replace("SETTLE", settle)


def short_fence(repeats: int = 2, settle: str = "1 s") -> str:
    """Write a protocol of a few drops of a fence, which are quickly analysed."""
    text = (PROTOCOLS / "picket-fence.yaml").read_text("utf-8")
    return text.replace("repeats: 10, settle: 5 s", f"repeats: {repeats}, settle: {settle}")


def record(folder: Path, text: str, url: str = "sim://", name: str = "s", codes=(0,)) -> Path:
    """Write a protocol, have its runs recorded, and return the session."""
    protocol, session = folder / f"{name}.yaml", folder / f"{name}.session"
    protocol.write_text(text, "utf-8")
    words = ["run", str(protocol), "--port", url, "--session", str(session), "--yes"]
    assert main(words) in codes
    return session


def command(*arguments: object) -> list[str]:
    """Name the program as a user starts it; a warning is an error there too."""
    return [sys.executable, "-W", "error", "-m", "rig", *map(str, arguments)]


def rig(*arguments: object, code: int = 0, **options: Any) -> Done:
    """Run ``rig`` as a process of its own, and see that it ends with a code."""
    streams = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    settings = {"cwd": ROOT, "text": True, "timeout": PATIENCE_S}
    done = subprocess.run(command(*arguments), check=False, **settings | streams | options)
    return end(done.returncode, done.stdout or "", done.stderr or "", code)


def truth_of(session: Path) -> list[dict[str, Any]]:
    """Return the hidden truth, one drop that fell a line."""
    file = session.with_name(session.name + ".truth.jsonl")
    if not file.exists():  # stopped before the simulation began
        return []
    return [json.loads(line) for line in file.read_text("utf-8").splitlines()]


def log_of(session: Path) -> dict[int, list[tuple[int, RunState]]]:
    """Return what became of each run, in order."""
    log: dict[int, list[tuple[int, RunState]]] = defaultdict(list)
    with Session.open(session, readonly=True) as opened:
        for entry in opened.states():
            log[entry.run].append((entry.attempt, entry.state))
    return dict(log)


def drops_of(session: Path) -> list[tuple[int, int]]:
    """Return run and attempt of every recorded drop, in order of recording."""
    with Session.open(session, readonly=True) as opened:
        return [(drop.run, drop.attempt) for drop in opened.drops()]


def frames_of(session: Path) -> list[tuple[str, Frame]]:
    """Return what went over the line, in order, each frame with its direction."""
    decoders = {"tx": Decoder(), "rx": Decoder()}
    with Session.open(session, readonly=True) as opened:
        return [(way, f) for _, way, data in opened.byte_log() for f in decoders[way].feed(data)]


def assert_whole(session: Path, planned: int) -> None:
    """Assert that a finished session is what it would be, had nobody ever interrupted it."""
    log, drops = log_of(session), drops_of(session)
    assert sorted(log) == list(range(1, planned + 1))
    for run, entries in log.items():
        good = [n for n, (_, state) in enumerate(entries) if state in GOOD]
        assert good == [len(entries) - 1], f"run {run} is done once, and nothing follows: {entries}"
        attempts = [attempt for attempt, _ in entries]
        assert attempts == sorted(attempts), f"run {run}: {entries}"
        recorded = [attempt for attempt, state in entries if state == RunState.RECORDED]
        assert recorded == [attempt for number, attempt in drops if number == run]
        assert recorded[-1] == attempts[-1]
        judged = {attempt for attempt, state in entries if state in {*GOOD, RunState.VOID}}
        assert judged == set(recorded), f"run {run}: every drop counts: {entries}"
    with Session.open(session, readonly=True) as opened:
        assert replay(opened).lines[-1] == "identical"
