"""What a class costs that looks on: processor time of the daemon and of its page's process.

A session of falling picket fences at a real pace, many times as quick as people hang them, and
browsers that ask as the page's script does.
"""

from __future__ import annotations

import time
from http.client import HTTPConnection
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from bench.process_fixture import ProcessFixture, processor_s
from rig.bench.findings import Findings
from rig.session.store import Session

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator

_HEAD = """\
# Cost of the page for onlookers

`./run bench board`: processor time over one core's, while picket fences fall; browsers ask each
second."""
BROWSERS = 30
_LASTING_S = 60
_SETTLED_S = 10.0  # until everything is loaded and the first drops were drawn
_RUNS = 1000


def run(_arguments: Namespace) -> Iterator[Findings]:
    """Measure both processes while browsers look on."""
    with ProcessFixture(_RUNS, seed=1) as rig:
        rig.start_daemon("--board", ":0")
        assert rig.daemon is not None
        assert rig.daemon.stderr is not None
        port, daemon = urlsplit(rig.daemon.stderr.readline().split()[-1]).port, rig.daemon.pid
        page = int(Path(f"/proc/{daemon}/task/{daemon}/children").read_text("ascii"))
        lines = [HTTPConnection("localhost", port) for _ in range(BROWSERS)]
        rig.start_runner()
        time.sleep(_SETTLED_S)
        begun, before, tag = time.monotonic(), [*map(processor_s, (daemon, page))], ""
        for second in range(_LASTING_S):
            for line in lines:  # only what is new comes again
                line.request("GET", "/", headers={"If-None-Match": tag, "Accept-Encoding": "gzip"})
                answer = line.getresponse()
                answer.read()
            tag = answer.headers["ETag"]
            time.sleep(max(0.0, begun + second + 1 - time.monotonic()))
        lasted_s = time.monotonic() - begun
        after = map(processor_s, (daemon, page))
        shares = [(end - start) / lasted_s for start, end in zip(before, after, strict=True)]
        with Session.open(rig.session, readonly=True) as session:
            drops = len(session.latest_drops())
    figures = {"browsers": BROWSERS, "drops": drops, "daemon": shares[0], "page": shares[1]}
    text = f"{BROWSERS} browsers, {drops} drops: daemon {shares[0]:.1%}, page {shares[1]:.1%}"
    yield Findings(figures, [text], _HEAD, name="board")
