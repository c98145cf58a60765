"""The table of actions and the operator's own keys."""

from collections import Counter

import pytest

from rig.campaign.machine import Stage
from rig.errors import InputError
from rig.tui.actions import ACTIONS, BY_NAME, help_text, possible, shown_key
from rig.tui.keys import merge_keys, read_keys
from rig.tui.widgets.text import LONGEST, duration, plain
from tests.tables import cases


def test_every_key_has_one_meaning():
    keys = Counter(key for action in ACTIONS for key in action.keys.split(","))
    assert max(keys.values()) == 1
    assert len(BY_NAME) == len(ACTIONS)


def test_help_has_every_action_under_one_heading():
    text = help_text({action.name: action.keys for action in ACTIONS}, wide=True).plain
    for action in ACTIONS:
        assert text.count(f"  {shown_key(action.keys):8}{action.text}") == 1
        assert text.count(f"\n{action.group}\n") == 1


def test_stop_is_possible_always():
    for stage in Stage:
        for driving in (True, False):
            assert possible(BY_NAME["stop"], stage, driving=driving)


def test_what_drives_the_rig_needs_control_and_its_stage():
    arms = BY_NAME["go_on"]
    assert possible(arms, Stage.PREPARE, driving=True)
    assert not possible(arms, Stage.PREPARE, driving=False)
    assert not possible(arms, Stage.COUNTDOWN, driving=True)


def test_a_file_changes_keys_and_takes_them_from_others(tmp_path):
    file = tmp_path / "keys.toml"
    file.write_text('reject = "r,f5"\nnote = "x"\n', "utf-8")
    keys = read_keys(file)
    assert (keys["reject"], keys["note"]) == ("r,f5", "x")
    assert keys["go_on"] == BY_NAME["go_on"].keys


def test_f9_always_stops_and_enter_goes_on():
    given = merge_keys({"stop": "f12", "go_on": "space"}, "k")
    assert (given["stop"], given["go_on"]) == ("f12,f9", "space,enter")
    with pytest.raises(InputError, match="f9 already belongs to stop"):
        merge_keys({"note": "f9"}, "k")


@cases
def test_a_wrong_key_file_says_what_is_wrong(tmp_path, text, said):
    file = tmp_path / "keys.toml"
    file.write_text(text, "utf-8")
    with pytest.raises(InputError) as caught:
        read_keys(file)
    assert said in str(caught.value)


def test_a_key_file_that_was_named_must_be_there(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        read_keys(tmp_path / "none.toml")


def test_without_a_file_the_keys_are_the_tables(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert read_keys() == {action.name: action.keys for action in ACTIONS}


def test_text_from_outside_is_one_harmless_line():
    nasty = "a\x1b[31m[/red]\n\x07b\u202ec\ud800"
    assert plain(nasty) == "a�[31m[/red] �b�c�"
    assert len(plain("x" * 10**6)) == LONGEST
    assert plain("x" * LONGEST) == "x" * LONGEST


def test_durations():
    assert [duration(s) for s in (3, 61, 3660)] == ["3 s", "1 min 01 s", "1 h 01 min"]


def test_keys_are_written_as_they_stand_on_a_keyboard():
    assert [shown_key(keys) for keys in ("f9", "ctrl+p", "x", "question_mark,f1", "enter")] == [
        "F9", "Ctrl-P", "x", "?", "Enter"
    ]  # fmt: skip
