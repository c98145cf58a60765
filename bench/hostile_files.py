"""Files as nobody made them on purpose, through every command that reads them, each in a process.

Anything but a result or the project's own error fails, as does more memory or time than a sound
file could need.
"""

from __future__ import annotations

import os
import resource
import shutil
import signal
import sys
import time
import traceback
from contextlib import redirect_stdout
from functools import partial
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, NamedTuple

from bench.mutants import CSV, LONGEST_S, MEMORY_BYTES, Mutants, altered_text, make_session
from bench.process_fixture import FENCE
from rig.bench.findings import Findings
from rig.cli import main as rig
from rig.commands.output import say
from rig.text_table import text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable, Iterator

    Reading = Callable[[int, str], None]

SESSION, PROTOCOL, TABLE = "session", "protocol", "table"
COMMANDS = {
    SESSION: ("recover", "analyze", "export", "replay", "report"),
    PROTOCOL: ("check", "predict"),
    TABLE: ("import",),
}
_OWN = range(5)  # exit codes of the project
_FAILED = 99


class Cost(NamedTuple):
    """What one command made of one file: how it ended, and what that took."""

    code: int
    seconds: float
    memory_bytes: int

    @property
    def fault(self) -> str:
        """What is wrong with it; empty when nothing is."""
        if self.code == -signal.SIGALRM:
            return f"more than {LONGEST_S:g} s"
        if self.code not in _OWN:
            return "not the project's own error"
        return "too much memory" if self.memory_bytes > MEMORY_BYTES else ""


def run(arguments: Namespace) -> Iterator[Findings]:
    """Alter, read, and find what it cost; it has failed when anything did."""
    counts = {SESSION: arguments.sessions, PROTOCOL: arguments.protocols, TABLE: arguments.tables}
    costs: dict[tuple[str, str], list[Cost]] = {}
    with TemporaryDirectory(prefix="rig-mutants-") as place:
        folder = Path(place)
        with redirect_stdout(StringIO()):
            rig(["analyze", str(make_session(folder))])  # all is loaded before the first is read
        for kind, write in _writers(folder).items():
            for seed in range(arguments.seed, arguments.seed + counts[kind]):
                path = write(seed)
                for command in COMMANDS[kind]:
                    cost = in_process(partial(_read, command, path, folder))
                    costs.setdefault((kind, command), []).append(cost)
                    if cost.fault:
                        say(f"{kind} {seed}, rig {command}: {cost.fault}")
    rows = [["file", "command", "times", "read", "refused", "longest s", "most MB", "failed"]]
    rows += [[kind, command, *_counted(each)] for (kind, command), each in costs.items()]
    record = {f"{kind} {command}": each for (kind, command), each in costs.items()}
    failed = any(cost.fault for each in costs.values() for cost in each)
    yield Findings(record, text_table(rows, left={0, 1}, rule=True), failed=failed)


def _counted(costs: list[Cost]) -> list[str]:
    read = sum(cost.code in {0, 1, 3} for cost in costs)
    refused = sum(cost.code in _OWN for cost in costs) - read
    longest = max(cost.seconds for cost in costs)
    most = max(cost.memory_bytes for cost in costs) / 1e6
    failed = sum(bool(cost.fault) for cost in costs)
    return [*map(str, (len(costs), read, refused)), f"{longest:.1f}", f"{most:.0f}", str(failed)]


def _writers(folder: Path) -> dict[str, Callable[[int], Path]]:
    """Say how each kind of file is written; the same for the same seed."""
    sound, protocol, table = folder / "sound", folder / "mutant.yaml", folder / "mutant.csv"
    text = FENCE.replace("RUNS", "2")
    (folder / "sound.yaml").write_text(text, "utf-8")
    sessions = Mutants(sound, folder)

    def session(seed: int) -> Path:
        path = folder / "mutant"
        for one in folder.glob("mutant*"):
            shutil.rmtree(one) if one.is_dir() else one.unlink()
        sessions.write(seed, path)
        return path

    def write(path: Path, sound: str) -> Callable[[int], Path]:
        def one(seed: int) -> Path:
            path.write_text(altered_text(sound, seed), "utf-8", errors="replace")
            return path

        return one

    return {SESSION: session, PROTOCOL: write(protocol, text), TABLE: write(table, CSV)}


def _read(command: str, path: Path, folder: Path) -> int:
    given = [command, str(path)]
    if command == "export":
        given += ["--csv", str(folder / "mutant.tables")]
    elif command == "report":
        given += ["-o", str(folder / "mutant.html")]
    elif command == "import":
        session = folder / "mutant.session"
        session.unlink(missing_ok=True)
        given += ["--protocol", str(folder / "sound.yaml"), "--session", str(session)]
    return rig(given)


def in_process(work: Callable[[], int]) -> Cost:
    """Do something in a process of its own, with an end to its time; say nothing of what it says.

    Parameters
    ----------
    work
        Gives the exit code.
    """
    begun = time.monotonic()
    child = os.fork()
    if not child:
        code = _FAILED
        try:
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
            signal.setitimer(signal.ITIMER_REAL, LONGEST_S)
            resource.setrlimit(resource.RLIMIT_AS, (8 * MEMORY_BYTES, 8 * MEMORY_BYTES))
            loud = os.dup(2)
            silent = os.open(os.devnull, os.O_RDWR)
            for stream in (0, 1, 2):
                os.dup2(silent, stream)
            code = work()
        except BaseException:
            os.dup2(loud, 2)
            traceback.print_exc(file=sys.stderr)
        finally:
            os._exit(code)
    _, status, usage = os.wait4(child, 0)
    memory_bytes = usage.ru_maxrss * 1024
    return Cost(os.waitstatus_to_exitcode(status), time.monotonic() - begun, memory_bytes)
