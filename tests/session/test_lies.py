"""What no board that works would say is kept as it came, judged, and told of in plain words."""

import json

import pytest

from bench.mutants import make_session
from rig.cli import main
from rig.records import Certificate, Drop, Edge
from rig.session.schema import RunState
from rig.session.store import Session

HZ = 16_000_000
TICKS = {
    "backwards": lambda n: HZ // 2 - 100 * n,
    "at the end of 64 bits": lambda n: 2**63 - 200 + n,
    "before all time": lambda n: n - 2**63,
    "at once": lambda _: 1000,
    "as fast as it can": lambda n: n,
}
COUNT = 200


@pytest.mark.parametrize("ticks", TICKS.values(), ids=TICKS)
def test_edges_that_cannot_be_are_kept_and_void(ticks, tmp_path, capsys):
    edges = tuple(Edge(ticks(n), n % 2, n // 2 % 2 == 0) for n in range(COUNT))
    session = make_session(tmp_path)
    with Session.open(session) as opened:
        # A pulse too short to be seen leaves open what the CRC is of.
        account = Certificate(COUNT + 1, crc32=1, glitches=1)
        opened.add_drop(Drop(1, 2, HZ, edges, 5, 0, account), provenance="device")
        opened.add_state(1, 2, RunState.RECORDED, 10**12)
    capsys.readouterr()
    assert main(["analyze", "--json", str(session)]) == 3
    (run,) = json.loads(capsys.readouterr().out)["runs"]
    assert run["verdict"] == "void"
    assert run["reasons"]
    with Session.open(session, readonly=True) as opened:
        assert opened.drop(1, 2).edges == edges
