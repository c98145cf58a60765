"""What is known before anything is hung: how long a drop lasts, what it wants of a board."""

import re

import pytest

from rig.boards import BOARDS, GATES, LONGEST_RECORD_MS
from rig.cli import main
from rig.errors import InputError
from rig.model.fall import free_leg
from rig.protocol.describe import describe
from rig.protocol.keys import MOST_RODS
from rig.protocol.measurable import (
    LEAST_RECORD_MS,
    check_measurable,
    check_recordable,
    longest_fall,
    record_ms,
)
from rig.protocol.reader import parse, read
from rig.protocol.yamltree import load, place_of
from tests.protocol.test_protocol_reader import GOOD

LONG = GOOD.replace("drop: 180 mm ± 2 mm", "drop: 12 m ± 5 mm")
SLOW = GOOD.replace("9.81 m/s^2", "1 m/s^2")
ENDLESS = GOOD.replace("drop: 180 mm ± 2 mm", "drop: 100 m").replace("9.81 m/s^2", "0.05 m/s^2")


@pytest.mark.parametrize("text", [LONG, SLOW])
def test_a_recording_outlasts_the_fall(text):
    protocol = parse(text)
    chain, drop, gravity = protocol.chains["A"].chain, protocol.drop.value, protocol.gravity.value
    past_the_gate, down = (
        free_leg(chain.length + way, 0.0, gravity)[1] for way in (drop - 0.02, drop)
    )
    assert LEAST_RECORD_MS / 1e3 < past_the_gate < longest_fall(protocol)
    assert down + protocol.release.pulse < record_ms(protocol) / 1e3 < 3.0


def test_a_fall_that_no_board_can_record_is_refused_beforehand():
    protocol = parse(ENDLESS, "f")
    assert record_ms(protocol) > LONGEST_RECORD_MS
    with pytest.raises(InputError, match=r"f:7:7: drop: from here .* at most 65.535 s"):
        check_recordable(protocol)
    check_measurable(protocol)  # what another timer recorded is not refused
    note = "note: cannot be recorded: f:7:7: drop: from here a drop takes up to 63.6 s"
    assert note in describe(protocol)
    check_recordable(parse(LONG))


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


def test_a_place_that_is_not_there_is_that_of_what_is_around_it():
    tree = load("a: 1\nb: {c: [2, 3]}\n", "f")
    assert (place_of(tree, "b", "c", 1).line, place_of(tree, "b", "c", 1).column) == (2, 12)
    assert place_of(tree, "b", "c", 7) == place_of(tree, "b", "c")
    assert place_of(tree, "b", "x", "y") == place_of(tree, "b")
    assert place_of(tree, "x").line == 1
