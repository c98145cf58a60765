"""What screens are told and say: state, actions and keys, text from outside, ASCII."""

import copy
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.pictures import QUIET, FakeClient
from rig.campaign.machine import Flow, GoOn, Stage, step
from rig.daemon.replica import Replica
from rig.errors import InputError
from rig.reasons import make_reason, plain_reason, remedies
from rig.records import Job
from rig.tui.actions import ACTIONS, BY_NAME, help_text, shown_key
from rig.tui.app import RigApp
from rig.tui.ascii import in_ascii
from rig.tui.client import ReconnectingClient
from rig.tui.context import Options, ascii_only
from rig.tui.follow import _back
from rig.tui.indicators import Indicators
from rig.tui.keys import merge_keys, read_keys
from rig.tui.model import Model, alarm
from rig.tui.pages.drop import verdict_words
from rig.tui.state import DaemonState, read_state
from rig.tui.widgets.bars import headline, hints
from rig.tui.widgets.text import LONGEST, duration, plain
from tests.refusals import refused
from tests.tables import cases
from tests.tui.lab import KEYS, text_of

NASTY = ["[red]x[/", "[/]", "\x1b[2J\x07\x9b31m", "x" * 10_000, "[@click=app.exit]a", "a\nb\u202ec"]


def model(text):
    state = {"port": {"url": text, "simulated": True}, "session": {"title": text, "path": text},
             "control": {"client": text}, "link": {"state": "up"}, "runs": [RUN]}  # fmt: skip
    flow = Flow(Stage.RESULT, Job(1, 1), verdict="void", reasons=(plain_reason(text),))
    return Model(FakeClient(read_state(state)), flow, state=read_state(state))


@pytest.mark.parametrize("text", NASTY, ids=range(len(NASTY)))
def test_what_comes_from_outside_is_shown_as_text(text):
    shown = [headline(replace(model(text), page="run"), 78), verdict_words(model(text))]
    for content in shown:
        assert not any(ord(letter) < 32 and letter != "\n" for letter in content.plain)
        assert not any("\x7f" <= letter <= "\x9f" for letter in content.plain)
        assert len(content.plain) < 500
    if text.isprintable() and len(text) < 20:
        assert all(text in content.plain for content in shown)
    assert len(shown[0].plain) == 78
    assert "▲ SIMULATED" in shown[0].plain


def test_a_void_drop_says_what_to_do():
    reason = make_reason("release_skew", skew_s=9.19e-3, limit_s=5e-3)
    flow = Flow(Stage.RESULT, Job(1, 1), verdict="void", reasons=(reason,))
    (advice,) = remedies([reason])
    words = verdict_words(replace(model("x"), flow=flow)).plain
    assert words.endswith(f"{reason.text}\n  → {advice}")


def test_enter_is_not_offered_before_the_verdict_is_kept():
    """It would do nothing: what comes next depends on the verdict."""
    shown = model("x")
    kept = shown.flow._replace(verdict="accepted")
    waits = kept._replace(logged=False)
    job = Job(2, 1)
    assert step(waits, GoOn(job, 0.0)) == (waits, ())
    assert "Enter after the verdict is saved" in keys_of(replace(shown, flow=waits))
    assert step(kept, GoOn(job, 0.0))[0].job == job
    assert "Enter end" in keys_of(replace(shown, flow=kept))
    assert "Enter next run" in keys_of(replace(shown, flow=kept, state=DaemonState()))


def keys_of(shown, width=80):
    return hints(replace(shown, page="result"), KEYS, width).plain


@pytest.mark.parametrize("width", [20, 40, 78, 198])
def test_keys_fit_their_line(width):
    assert len(keys_of(model("x"), width)) <= width


RUN = {"run": 1, "incline_deg": 40, "impact": "A", "free": "B", "setting": "",
       "attempt": 0, "state": "planned", "reasons": [], "reason_codes": []}  # fmt: skip
STATE = QUIET | {"runs": [RUN], "edges": [[1, 2, 1]]}


def test_what_the_daemon_does_not_know_is_not_known():
    state = read_state(STATE | {"gates": None, "runs": None, "edges": None})
    assert state.blocked_mask is None
    assert (state.runs, state.edges, state.holder) == ((), (), None)


def test_a_state_once_taken_never_changes():
    replica = Replica()
    replica.follow("snapshot", copy.deepcopy({"n": 7, "state": STATE}))
    taken = read_state(replica.state)
    as_it_was = copy.deepcopy(taken)
    changes = {"set": {"gates": {"blocked": 9}}, "runs": [RUN | {"state": "void"}]}
    replica.follow("change", {"n": 8, "edges": [[1, 2, 1]], **changes})
    assert taken == as_it_was != read_state(replica.state)


def test_indicators_count_name_and_judge_steadiness():
    indicators = Indicators.of((0, 3)).seen(0b0001, 0.0).seen(0b1000, 1.0)
    assert indicators.alone == 3
    assert indicators.blocked_channels == (3,)
    indicators = indicators.seen(0, 1.2)
    assert indicators.checked == {3}
    assert indicators.restless(1.3) == (0, 3)
    assert (indicators.blocked_channels, indicators.restless(2.3)) == ((), ())
    assert [one.edges for one in indicators.gates] == [1, 2], "blocked at first is no change"
    assert indicators.count_edges((0, 0, 0, 0), 5.0).gates[0].flickers(5.0)
    assert not indicators.seen(None, 3.0).known
    assert indicators.reset().checked == frozenset()


def _model(**state):
    return Model(FakeClient(DaemonState()), Flow(), state=read_state(STATE | state))


def test_what_is_wrong_is_said_with_what_to_do():
    assert not alarm(_model())
    for stage, begun in ((Stage.PROTOCOL, False), (Stage.PREPARE, True)):
        gone = alarm(Model(ReconnectingClient("sim://", None, None), Flow(stage)))
        assert "no daemon: connecting" in gone
        assert ("supply" in gone) == begun, "nothing of ours can fall before that"
    lost = alarm(_model(link={"state": "down", "error": {"message": "[unplugged"}, "retry_s": 2}))
    assert "[unplugged" in lost
    assert "cable" in lost
    failed = _model(error={"message": "disk full", "hint": "make room"})
    assert alarm(failed) == "disk full\nmake room"


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
    assert not [*_back(line, read_state(replica.state))]  # not all is well yet
    replica.follow("change", {"n": 3, "set": {"error": None}})
    line._note(replica)
    back = read_state(replica.state)
    (said,) = _back(line, back)
    assert said.trouble == "the port was lost and is back: the board restarted\ncheck its supply"
    assert not [*_back(line, back)]


def test_every_key_has_one_meaning():
    assert max(Counter(key for action in ACTIONS for key in action.keys.split(",")).values()) == 1
    assert len(BY_NAME) == len(ACTIONS)


def test_help_has_every_action_under_one_heading():
    text = help_text({action.name: action.keys for action in ACTIONS}, wide=True).plain
    for action in ACTIONS:
        assert text.count(f"  {shown_key(action.keys):8}{action.text}") == 1
        assert text.count(f"\n{action.group}\n") == 1


def test_a_file_changes_keys_and_takes_them_from_others(tmp_path):
    file = tmp_path / "keys.toml"
    file.write_text('reject = "r,f5"\nnote = "x"\n', "utf-8")
    keys = read_keys(file)
    assert (keys["reject"], keys["note"]) == ("r,f5", "x")
    assert keys["go_on"] == BY_NAME["go_on"].keys


def test_f9_always_stops_and_enter_goes_on():
    given = merge_keys({"stop": "f12", "go_on": "space"}, "k")
    assert (given["stop"], given["go_on"]) == ("f12,f9", "space,enter")
    refused(InputError, "f9 already belongs to stop", merge_keys, {"note": "f9"}, "k")


@cases
def test_a_wrong_key_file_says_what_is_wrong(tmp_path, text, said):
    file = tmp_path / "keys.toml"
    file.write_text(text, "utf-8")
    assert said in str(refused(InputError, "", read_keys, file))


def test_a_key_file_that_was_named_must_be_there(tmp_path):
    refused(InputError, "No such file", read_keys, tmp_path / "none.toml")


def test_without_a_file_the_keys_are_the_tables(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert read_keys() == {action.name: action.keys for action in ACTIONS}


def test_text_from_outside_is_one_harmless_line():
    assert plain("a\x1b[31m[/red]\n\x07b\u202ec\ud800") == "a�[31m[/red] �b�c�"
    assert len(plain("x" * 10**6)) == LONGEST
    assert plain("x" * LONGEST) == "x" * LONGEST


WRITTEN = {"duration": duration, "key": shown_key, "ascii": in_ascii}


@cases
def test_it_is_written_as_people_read_it(what, value, said):
    assert WRITTEN[what](value) == said


@given(st.text(st.characters(exclude_categories=["M", "C"])))
def test_every_text_keeps_its_length_and_is_ascii(text):
    assert in_ascii(text).isascii()
    assert len(in_ascii(text)) == len(text)


@cases
def test_terminal_and_locale_say_when(environment, is_ascii):
    assert ascii_only(environment) is is_ascii


async def test_a_whole_screen_is_ascii():
    app = RigApp(Options(ascii=True), KEYS, FakeClient(DaemonState(QUIET)))
    app.model.flow = Flow(Stage.DEVICE)
    async with app.run_test(size=(80, 24)) as pilot:
        while "DEVICE" not in text_of(app):
            await pilot.pause()
        assert text_of(app).isascii()
        assert "# STOP  F9 or Esc" in text_of(app)
