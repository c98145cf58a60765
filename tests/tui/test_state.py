"""What the screens are told: typed, and not changed under them."""

import copy
from pathlib import Path

from rig.campaign.machine import Flow, Stage
from rig.daemon.replica import Replica
from rig.tui.client import ReconnectingClient
from rig.tui.follow import _back
from rig.tui.indicators import Indicators
from rig.tui.model import Model, alarm
from rig.tui.state import DaemonState, read_state

RUN = {"run": 1, "incline_deg": 40, "impact": "A", "free": "B", "attempt": 0, "state": "planned",
       "reasons": [], "reason_codes": []}  # fmt: skip
STATE = {
    "phase": "idle", "link": {"state": "up", "error": None, "retry_s": None},
    "port": {"url": "sim://", "simulated": True}, "gates": {"blocked": 5, "age_s": 0.0},
    "drop": None, "session": None, "control": None, "error": None,
    "runs": [RUN, RUN | {"run": 2, "impact": "B", "free": "A"}], "edges": [[1, 2, 1]],
}  # fmt: skip


def test_what_the_daemon_does_not_know_is_not_known():
    state = read_state(0, STATE | {"gates": None, "runs": None, "edges": None})
    assert state.blocked_mask is None
    assert (state.runs, state.edges, state.holder) == ((), (), None)
    assert DaemonState().n < 0 <= state.n


def test_a_state_once_taken_never_changes():
    replica = Replica()
    replica.follow("snapshot", copy.deepcopy({"n": 7, "state": STATE}))
    taken = read_state(replica.n, replica.state)
    as_it_was = copy.deepcopy(taken)
    changes = {"set": {"gates": {"blocked": 9}}, "runs": [RUN | {"state": "void"}]}
    replica.follow("change", {"n": 8, "edges": [[1, 2, 1]], **changes})
    assert taken == as_it_was != read_state(replica.n, replica.state)


def test_indicators_count_name_and_judge_steadiness():
    indicators = Indicators.of((0, 3)).seen(0b0000, 0.0).seen(0b1000, 1.0)
    assert indicators.alone == 3
    assert indicators.blocked_channels == (3,)
    indicators = indicators.seen(0, 1.2)
    assert indicators.checked == {3}
    assert indicators.restless(1.3) == (3,)
    assert (indicators.blocked_channels, indicators.restless(2.3)) == ((), ())
    assert [one.edges for one in indicators.gates] == [0, 2]
    assert indicators.count_edges((0, 0, 0, 0), 5.0).gates[0].flickers(5.0)
    assert not indicators.seen(None, 3.0).known
    assert indicators.reset().checked == frozenset()


def test_a_gate_that_is_blocked_from_the_beginning_has_not_changed():
    indicators = Indicators.of((2,)).seen(0b100, 0.0)
    assert (indicators.gates[0].edges, indicators.blocked_channels) == (0, (2,))


def _model(state=None, **more):
    return Model(read_state(0, STATE | (state or {})), Flow(), Indicators(), connected=True, **more)


def test_what_is_wrong_is_said_with_what_to_do():
    assert alarm(_model()) is None
    for stage, begun in ((Stage.PROTOCOL, False), (Stage.PREPARE, True)):
        gone = alarm(Model(DaemonState(), Flow(stage), Indicators(), silence="it is gone"))
        assert "it is gone" in gone.message
        assert ("supply" in gone.hint) == begun, "nothing of ours can fall before that"
    lost = alarm(
        _model({"link": {"state": "down", "error": {"message": "[unplugged"}, "retry_s": 2}})
    )
    assert "[unplugged" in lost.message
    assert "cable" in lost.hint
    failed = alarm(_model({"error": {"message": "disk full", "hint": "make room"}}))
    assert failed == ("disk full", "make room")


def test_a_port_that_is_back_before_anybody_looked_was_lost_all_the_same():
    """Changes come in between two looks: a board restarts in less than a tenth of a second."""

    async def connected():
        return

    line, replica = ReconnectingClient("sim://", Path("rig.sock"), connected), Replica()
    error = {"message": "the board restarted", "hint": "check its supply"}
    replica.follow(
        "snapshot", {"n": 1, "state": {"link": {"state": "down"}, "error": error, "edges": []}}
    )
    line._note(replica)
    replica.follow("change", {"n": 2, "set": {"link": {"state": "up"}}})
    line._note(replica)
    assert not [*_back(line, read_state(replica.n, replica.state))]  # not all is well yet
    replica.follow("change", {"n": 3, "set": {"error": None}})
    line._note(replica)
    back = read_state(replica.n, replica.state)
    (said,) = _back(line, back)
    assert said.trouble == "the port was lost and is back: the board restarted\ncheck its supply"
    assert not [*_back(line, back)]


def test_a_watcher_sees_where_the_drop_is():
    for drop, stage in (("armed", Stage.COUNTDOWN), ("fired", Stage.LIVE)):
        watched = _model({"drop": {"run": 1, "attempt": 1, "state": drop}})
        assert watched.stage is stage
    assert _model({"drop": {"state": "armed"}}, driving=True).stage is Stage.PROTOCOL
