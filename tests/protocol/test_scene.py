"""What follows from a protocol before anything is hung: plan, priors, what it asks of a board."""

import dataclasses
import re
from collections import Counter
from dataclasses import asdict

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.analysis.components import priors
from rig.boards import BOARDS, GATES, LONGEST_RECORD_MS
from rig.cli import main
from rig.errors import InputError
from rig.model.fall import free_leg
from rig.protocol import measurable
from rig.protocol.describe import describe
from rig.protocol.keys import MOST_RODS, SECTIONS
from rig.protocol.protocol import Priors, Run
from rig.protocol.reader import parse, read
from rig.protocol.site import gravity_at
from rig.protocol.yamltree import load, place_of
from rig.units import Quantity
from tests.analysis.drops import UNIFORM, case
from tests.protocol.test_protocol_reader import GOOD
from tests.refusals import refused
from tests.tables import cases, protocol_text

TWO = protocol_text("two-chains")


def planned(**changes):
    protocol = parse(TWO)
    plan = dataclasses.replace(protocol.plan, **changes)
    return dataclasses.replace(protocol, plan=plan).runs()


@cases
def test_order_within_each_incline(order, impact):
    made = planned(inclines=(10.0, 40.0), repeats=6, order=order)
    assert "".join(run.impact for run in made) == impact * 2
    assert [run.number for run in made] == list(range(1, 13))
    assert all({run.impact, run.free} == {"A", "B"} for run in made)


@given(st.integers(0, 2**63 - 1), st.sampled_from(["incline", "all"]))
def test_shuffling_keeps_every_drop(seed, randomize):
    inclines = (0.0, 10.0, 20.0, 30.0)
    ordered = planned(inclines=inclines, repeats=8)
    mixed = planned(inclines=inclines, repeats=8, randomize=randomize, seed=seed)
    assert Counter(dataclasses.replace(run, number=0) for run in mixed) == Counter(
        dataclasses.replace(run, number=0) for run in ordered
    )
    if randomize == "incline":
        assert "".join(run.impact for run in mixed) == "ABBA" * 8


def test_the_shuffle_is_the_same_for_ever():
    made = planned(inclines=tuple(range(0, 90, 10)), randomize="incline", seed=7)
    assert [run.incline_deg for run in made] == [60, 30, 50, 70, 80, 0, 40, 10, 20]


def test_scenes_with_one_chain():
    one = TWO.replace("  B: {like: A}\n", "")
    assert parse(one).runs() == (Run(1, 0.0, "A", None),)
    falling = one.replace("surface: {restitution: 0.5}\n", "")
    assert parse(falling).runs() == (Run(1, 0.0, None, "A"),)


@cases
def test_normal_gravity(latitude, height, expected, within):
    assert gravity_at(latitude, height).value == pytest.approx(expected, abs=within)


def test_site_in_a_protocol():
    protocol = parse(TWO.replace("gravity: 9.81 m/s^2", "site: {latitude: 45°, height: 0 m}"))
    assert protocol.gravity == gravity_at(45, 0)


PRIORS = SECTIONS["priors"]


def scene(priors: str):
    return parse(f"{UNIFORM.text}\npriors: {priors}\n", "f")


def test_every_prior_has_a_key_and_what_is_left_out_is_as_by_default():
    assert [*PRIORS] == [*asdict(Priors())]
    found = scene("{hang: 1 mm, jitter: 5 us, drag: 0.2, impulses: 8 %, side: 0 mm}").priors
    assert found == Priors(hang=1e-3, jitter=5e-6, drag=0.2, impulses=0.08, side=0.0)
    assert UNIFORM.priors == Priors()


def test_rig_check_lists_them_all_and_marks_those_of_the_protocol():
    lines = describe(scene("{hang: 1 mm}")).splitlines()
    for name, key in PRIORS.items():
        (line,) = [one for one in lines if one.split()[:1] == [name]]
        assert line.endswith(key.meaning)
        assert ("(stated)" in line) == (name == "hang")


def test_an_adjustment_takes_what_the_protocol_states():
    wide = scene(
        "{hang: 3 mm, side: 5 mm, beam_offset: 10 mm, drag: 0.5, impulses: 50 %, departure: 2 mm}"
    )
    one = case(UNIFORM, incline=40.0)
    components = priors(wide)
    assert (components.hang, components.beam, components.impulse) == (3e-3, 10e-3, 0.5)
    narrow, loose = (
        case(protocol, run=one.run.number).analyze().quantities["separation_m"]
        for protocol in (UNIFORM, wide)
    )
    assert loose.u > 1.2 * narrow.u


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
    assert measurable.LEAST_RECORD_MS / 1e3 < past_the_gate < measurable.longest_fall(protocol)
    assert down + protocol.release.pulse < measurable.record_ms(protocol) / 1e3 < 3.0


def test_a_fall_that_no_board_can_record_is_refused_beforehand():
    protocol = parse(ENDLESS, "f")
    assert measurable.record_ms(protocol) > LONGEST_RECORD_MS
    said = r"f:7:7: drop: from here .* at most 65.535 s"
    refused(InputError, said, measurable.check_recordable, protocol)
    measurable.check_measurable(protocol)  # what another timer recorded is not refused
    note = "note: cannot be recorded: f:7:7: drop: from here a drop takes up to 63.6 s"
    assert note in describe(protocol)
    measurable.check_recordable(parse(LONG))


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
            measurable.check_recordable(protocol, board)
        else:
            assert main(["check", str(path), "--board", word]) == 2
            assert f"the board ({board.name}) has " in capsys.readouterr().err


def test_a_place_that_is_not_there_is_that_of_what_is_around_it():
    tree = load("a: 1\nb: {c: [2, 3]}\n", "f")
    assert (place_of(tree, "b", "c", 1).line, place_of(tree, "b", "c", 1).column) == (2, 12)
    assert place_of(tree, "b", "c", 7) == place_of(tree, "b", "c")
    assert place_of(tree, "b", "x", "y") == place_of(tree, "b")
    assert place_of(tree, "x").line == 1


HEIGHTS = "{drop: [180 mm ± 1 mm, 228.5 mm ± 2 mm]}"


def vary(words: str):
    text = GOOD.replace("drop: 180 mm ± 2 mm", "") if "drop" in words else GOOD
    return parse(text.replace("repeats: 4", f"vary: {words}, repeats: 4"), "f")


def test_every_setting_is_a_scene_of_its_own_with_its_own_runs():
    protocol = vary(HEIGHTS)
    scenes = protocol.settings
    heights = [Quantity(0.18, 1e-3), Quantity(0.2285, 2e-3)]
    assert [scene.drop for scene in scenes.values()] == heights
    planned = protocol.runs()
    assert [run.setting for run in planned[::4]] == [*scenes] * 2
    assert len(planned) == 2 * len(parse(GOOD).runs())
    assert all(protocol.of(run) == scenes[run.setting] for run in planned)
    assert protocol.with_gates(()).of(planned[-1]).gates.gates == ()


def test_keys_are_varied_together_and_need_not_be_stated_elsewhere():
    scenes = vary("{drop: [100 mm, 200 mm], surface.friction: [0.1, 0.2, 0.3]}").settings
    values = [(scene.drop.value, scene.surface.friction.value) for scene in scenes.values()]
    assert values == [(drop, friction) for drop in (0.1, 0.2) for friction in (0.1, 0.2, 0.3)]


def test_what_only_another_setting_has_wrong_is_told_with_it():
    problems = refused(InputError, "", vary, "{drop: [180 mm, 26 mm]}").problems
    assert [problem.line for problem in problems] == [10, 11]
    for problem in problems:
        assert "rod 1 of A blocks before the release" in problem.message
        assert problem.message.endswith("(drop 26 mm)")


@pytest.mark.parametrize("count", [100, 101])
def test_settings_are_counted_before_they_are_read(count):
    words = f"{{surface.friction: [{', '.join(f'0.{200 + n}' for n in range(count))}]}}"
    if count <= 100:
        assert len(vary(words).settings) == count
    else:
        refused(InputError, "more than 100 settings", vary, words)
