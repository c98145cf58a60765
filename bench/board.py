"""What a class costs that looks on: processor time of the daemon and of its page's process.

A session of falling picket fences at a real pace, many times as quick as people hang them, and
browsers that ask as the page's script does.
"""

from __future__ import annotations

import threading
import time
from contextlib import ExitStack
from http.client import HTTPConnection
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from bench.frame import Findings
from bench.process_fixture import ProcessFixture, processor_s
from rig.commands.output import say
from rig.session.store import Session
from rig.text_table import text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator

_HEAD = """\
# Cost of the page for onlookers

`./run bench board`: processor time over one core's, while picket fences fall; browsers ask each
second."""
BROWSERS = 30
_ASK_S = 1.0
_LASTING_S = 60.0
_SETTLED_S = 10.0  # until everything is loaded and the first drops were drawn
_RUNS = 1000


def measure(browsers: int, *options: str) -> dict[str, Any]:
    """Return shares of a core while a session runs.

    Parameters
    ----------
    browsers
        That look on.
    options
        Of the daemon.
    """
    say(f"{browsers} browsers {' '.join(options)} …")
    with ExitStack() as stack:
        rig = stack.enter_context(ProcessFixture(_RUNS, seed=1))
        rig.start_daemon(*options)
        assert rig.daemon is not None
        assert rig.daemon.stderr is not None
        pids = {"daemon": rig.daemon.pid}
        over, answers = threading.Event(), list[int]()
        if options:
            port = urlsplit(rig.daemon.stderr.readline().split()[-1]).port or 0
            children = Path(f"/proc/{rig.daemon.pid}/task/{rig.daemon.pid}/children")
            pids["page"] = int(children.read_text("ascii"))
            for number in range(browsers):
                asking = threading.Thread(target=_browse, args=(port, number, over, answers))
                asking.start()
                stack.callback(asking.join)
        stack.callback(over.set)
        rig.start_runner()
        time.sleep(_SETTLED_S)
        before = {name: processor_s(pid) for name, pid in pids.items()}
        drops, count, begun = _drops(rig), len(answers), time.monotonic()
        time.sleep(_LASTING_S)
        lasted = time.monotonic() - begun
        shares = {name: (processor_s(pid) - before[name]) / lasted for name, pid in pids.items()}
        status = Path(f"/proc/{pids.get('page', pids['daemon'])}/status").read_text("ascii")
        return {
            "browsers": browsers,
            "drops": _drops(rig) - drops,
            "answers": len(answers) - count,
            "daemon_cpu": shares["daemon"],
            "page_cpu": shares.get("page"),
            "memory_bytes": int(status.partition("VmRSS:")[2].split()[0]) * 1024,
        }


def _browse(port: int, number: int, over: threading.Event, answers: list[int]) -> None:
    """Ask for the page each second, as browsers do: only what is new comes again."""
    over.wait(_ASK_S * number / BROWSERS)
    line, tag = HTTPConnection("localhost", port), ""
    while not over.wait(_ASK_S):
        line.request("GET", "/", headers={"If-None-Match": tag, "Accept-Encoding": "gzip"})
        answer = line.getresponse()
        answers.append(len(answer.read()))
        tag = answer.headers["ETag"]
    line.close()


def _drops(rig: ProcessFixture) -> int:
    with Session.open(rig.session, readonly=True) as session:
        return len(session.latest_drops())


def run(_arguments: Namespace) -> Iterator[Findings]:
    """Measure without the page, with it, and with a class that looks on."""
    board = "--board", ":0"
    rows = [measure(0), measure(0, *board), measure(BROWSERS, *board)]
    yield Findings({"board": rows}, text_table(_table(rows), left={0}), _HEAD, name="board")


def _table(rows: list[dict[str, Any]]) -> list[list[str]]:
    names = ("without the page", "with the page", f"with {BROWSERS} browsers")
    return [
        ["", "drops a minute", "answers", "daemon", "page", "memory of the page"],
        *(
            [
                name,
                f"{row['drops']}",
                f"{row['answers']}" if row["answers"] else "–",
                f"{row['daemon_cpu']:.1%}",
                "–" if row["page_cpu"] is None else f"{row['page_cpu']:.1%}",
                "–" if row["page_cpu"] is None else f"{row['memory_bytes'] / 1e6:.0f} MB",
            ]
            for name, row in zip(names, rows, strict=True)
        ),
    ]
