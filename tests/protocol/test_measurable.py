"""What is known before anything is hung: how long a drop lasts, what it wants of a board."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import pytest

from rig.boards import BOARDS, GATES, LONGEST_RECORD_MS, MEGA, RELEASES, UNO
from rig.cli import main
from rig.errors import InputError
from rig.model.fall import free_fall
from rig.protocol.describe import describe
from rig.protocol.keys import MOST_RODS
from rig.protocol.measurable import (
    LEAST_RECORD_MS,
    check_measurable,
    check_recordable,
    lacking,
    longest_fall,
    record_ms,
)
from rig.protocol.reader import parse, read
from rig.protocol.yamltree import load, place_of
from tests.protocol.test_protocol_reader import GOOD, READY

LONG = GOOD.replace("drop: 180 mm ± 2 mm", "drop: 12 m ± 5 mm")
SLOW = GOOD.replace("9.81 m/s^2", "1 m/s^2")
ENDLESS = GOOD.replace("drop: 180 mm ± 2 mm", "drop: 100 m").replace("9.81 m/s^2", "0.05 m/s^2")


@pytest.mark.parametrize("path", READY, ids=lambda path: path.stem)
def test_ordinary_drops_are_recorded_as_ever(path):
    protocol = read(path)
    if protocol.track is None:  # down a gentle slope it takes longer
        assert record_ms(protocol) == LEAST_RECORD_MS == 1500
    else:
        assert longest_fall(protocol) * 1e3 < record_ms(protocol)


@pytest.mark.parametrize("text", [LONG, SLOW])
def test_a_recording_outlasts_the_fall(text):
    protocol = parse(text)
    chain, drop, gravity = protocol.chains["A"].chain, protocol.drop.value, protocol.gravity.value
    past_the_gate, down = (free_fall(chain, way, gravity)[1] for way in (drop - 0.02, drop))
    assert LEAST_RECORD_MS / 1e3 < past_the_gate < longest_fall(protocol)
    assert down + protocol.release.pulse < record_ms(protocol) / 1e3 < 3.0


@pytest.mark.parametrize(
    ("old", "new", "least_ms"),
    [
        ("12 m ± 5 mm", "12 m ± 500 mm", 100),
        ("9.81 m/s^2", "9.81 ± 0.5 m/s^2", 100),
        ("plan:", "release: {pulse: 1080 ms}\nplan:", 1000),
        ("plan:", "accept: {release_skew: 1005 ms}\nplan:", 1000),
    ],
)
def test_what_makes_a_fall_end_later_makes_the_recording_longer(old, new, least_ms):
    assert record_ms(parse(LONG.replace(old, new))) >= record_ms(parse(LONG)) + least_ms


def test_the_longer_chain_decides():
    one = parse(LONG)
    other = parse(LONG.replace("{like: A}", "{like: A, length: 3 m}"))
    assert record_ms(other) > record_ms(one)
    assert longest_fall(other) > math.sqrt(2.0 * 15.0 / 9.81)


def test_gravity_that_is_hardly_known_leaves_an_end():
    assert math.isfinite(longest_fall(parse(LONG.replace("9.81 m/s^2", "9.81 ± 9 m/s^2"))))


def test_a_fall_that_no_board_can_record_is_refused_beforehand():
    protocol = parse(ENDLESS, "f")
    assert record_ms(protocol) > LONGEST_RECORD_MS
    with pytest.raises(InputError, match=r"f:7:7: drop: from here .* at most 65.535 s"):
        check_recordable(protocol)
    check_measurable(protocol)  # what another timer recorded is not refused
    note = "note: cannot be recorded: f:7:7: drop: from here a drop takes up to 63.6 s"
    assert note in describe(protocol)
    check_recordable(parse(LONG))


def test_what_a_board_lacks_is_said_at_its_place():
    release = "release: {channel: 2, pulse: 800 ms}\n"
    gates = "free: [{channel: 8, height: 20 mm}, {channel: 15, height: 60 mm}]"
    text = GOOD.replace("free: [{channel: 8, height: 20 mm}]", gates) + release
    protocol = parse(text, "f")
    with pytest.raises(InputError) as caught:
        check_recordable(protocol, UNO)
    assert [str(problem).partition(";")[0] for problem in caught.value.problems] == [
        "f:11:49: gates.free[1].channel: found 15",
        "f:13:20: release.channel: found 2",
        "f:13:30: release.pulse: found 800 ms",
    ]
    told = str(caught.value)
    for limit in ("gates 0 to 11", "releases 0 to 1", "pulses of at most 500 ms"):
        assert f"the board (Arduino Uno) has {limit}" in told
    assert [problem.key for problem in lacking(protocol, MEGA)] == [
        "release.channel",
        "release.pulse",
    ]
    said = describe(protocol)
    assert "note: board uno is not suitable: f:11:49: gates.free[1].channel: found 15;" in said
    assert "note: board mega is not suitable: f:13:20: release.channel: found 2;" in said
    for word, board in (("uno", UNO), ("mega", MEGA)):
        for problem in lacking(protocol, board):
            assert f"note: board {word} is not suitable: {problem}" in said


def up_to(limit, board):
    """A protocol that asks as much of a board as there is, and what asks for more."""
    pulsed = GOOD + "release: {channel: %d, pulse: %d us}\n"
    if limit == "releases":
        return [pulsed % (n, 80_000) for n in (board.releases - 1, board.releases)]
    if limit == "longest_pulse":
        longest = round(1e6 * board.longest_pulse)
        return [pulsed % (0, pulse) for pulse in (longest, longest + 1)]
    if limit == "gates":
        channels = [n for n in (board.gates - 1, board.gates) if n < GATES]
        return [GOOD.replace("channel: 8", f"channel: {n}") for n in channels]
    # Two gates, and two edges a rod at each.
    rods = [n for n in (board.events // 4, board.events // 4 + 1) if n <= MOST_RODS]
    thin = GOOD.replace("12.7 mm", "0.1 mm")
    return [thin.replace("rods: 25", f"rods: {n}") for n in rods]


@pytest.mark.parametrize("limit", ["releases", "longest_pulse", "gates", "events"])
@pytest.mark.parametrize("word", BOARDS)
def test_all_judge_alike_what_a_board_can_do(word, limit, tmp_path, capsys):
    path, board = tmp_path / "p.yaml", BOARDS[word]
    for more, text in enumerate(up_to(limit, board)):
        path.write_text(text)
        protocol, able = read(path), not more or (limit == "events" and board.streams)
        said = describe(protocol)
        (listed,) = re.findall("suitable boards: (.*)", said) or [""]
        assert (word in listed.split(", ")) == able
        assert (f"note: board {word} is not suitable: {path}:" in said) != able
        if able:
            check_recordable(protocol, board)
        else:
            assert main(["check", str(path), "--board", word]) == 2
            assert f"the board ({board.name}) has " in capsys.readouterr().err


def test_what_every_board_has_is_not_remarked_on():
    protocol = parse(GOOD)
    check_recordable(protocol, UNO)
    assert "not with" not in describe(protocol)
    wide = replace(MEGA, gates=GATES, releases=RELEASES, longest_pulse=2.0)
    check_recordable(parse(GOOD + "release: {channel: 7, pulse: 2 s}\n"), wide)


def test_a_place_that_is_not_there_is_that_of_what_is_around_it():
    tree = load("a: 1\nb: {c: [2, 3]}\n", "f")
    assert (place_of(tree, "b", "c", 1).line, place_of(tree, "b", "c", 1).column) == (2, 12)
    assert place_of(tree, "b", "c", 7) == place_of(tree, "b", "c")
    assert place_of(tree, "b", "x", "y") == place_of(tree, "b")
    assert place_of(tree, "x").line == 1
