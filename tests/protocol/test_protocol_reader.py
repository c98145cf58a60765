import os
from operator import attrgetter
from pathlib import Path

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from rig.errors import InputError
from rig.protocol.describe import describe
from rig.protocol.reader import parse, read
from rig.protocol.yamltree import load
from tests.examples import examples
from tests.refusals import refused
from tests.tables import cases, protocol_text

READY = sorted((Path(__file__).parents[2] / "protocols").glob("*.yaml"))
GOOD = protocol_text("two-gates")


def problems(text):
    error = refused(InputError, "", parse, text, "f")
    assert error.exit_code == 2
    return [str(problem) for problem in error.problems]


@cases
def test_what_is_written_is_read(old, new, name, value):
    assert old in GOOD
    assert attrgetter(name)(parse(GOOD.replace(old, new))) == value


@pytest.mark.parametrize("word", ["yes", "on", "tRUE", "1", ""])
def test_other_words_are_neither_true_nor_false(word):
    (problem,) = problems(f"{GOOD}blind: {word}\n")
    assert "accepted: true, True, TRUE, false, False, FALSE" in problem


@pytest.mark.parametrize("wrong", ["1 %", "-1 ppm", "1 ms"])
def test_what_is_no_reference_is_refused_at_its_place(wrong):
    (problem,) = problems(GOOD + f"reference: {wrong}\n")
    assert problem.startswith("f:13:12: reference: ")


def test_a_chain_inherits_and_overrides():
    protocol = parse(GOOD.replace("{like: A}", "{like: A, rods: 20, length: 1 m}"))
    a, b = protocol.chains.values()
    assert (b.chain.rods, b.chain.length) == (20, 1.0)
    assert b.tilt_deg == a.tilt_deg
    assert b.widths[0] == a.widths[0]


def test_graded_chain_has_equal_gaps_and_masses_like_cross_sections():
    rods = next(iter(read(next(p for p in READY if "graded" in p.stem)).chains.values()))
    diameters = [d for d in (0.032, 0.025, 0.019, 0.013, 0.0063) for _ in range(4)]
    heights = rods.chain.heights
    edges = [heights[i + 1] - heights[i] - (diameters[i] + diameters[i + 1]) / 2 for i in range(19)]
    assert edges == pytest.approx([edges[0]] * 19, abs=1e-15)
    assert rods.chain.length == 1.165
    assert rods.chain.masses == pytest.approx([(d / 0.032) ** 2 for d in diameters])


@cases
def test_each_fault_is_found_at_its_place(old, new, start):
    assert old in GOOD
    found = problems(GOOD.replace(old, new, 1))
    assert len(found) == 1, found
    assert found[0].startswith(start)
    assert_one_block(found[0])


def test_all_faults_come_at_once_and_an_inherited_one_comes_once():
    text = GOOD.replace("1165 mm", "1165").replace("9.81 m/s^2", "9.81").replace("4}", "x, sed: 1}")
    assert [line.split(": ")[0] for line in problems(text)] == ["f:4:25", "f:8:10", "f:12:43",
                                                               "f:12:46"]  # fmt: skip


@pytest.mark.parametrize("diameter", ["", ", diameter: 20 s"])
def test_an_object_is_never_asked_for_a_length(diameter):
    (problem,) = problems(protocol_text("ball").replace("rods: 1", f"rods: 1{diameter}"))
    assert " chains.ball.diameter: " in problem


def test_alias_bomb_is_refused():
    lines = ["a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [
        f"{b}: &{b} [{', '.join(['*' + a] * 9)}]" for a, b in zip("abcdef", "bcdefg", strict=True)
    ]
    assert "more than 10000 values" in problems("\n".join(lines))[0]


def test_scenes_without_a_surface():
    text = GOOD.replace("surface: {restitution: 0.50 ± 0.05}", "contact: {level: 0 mm ± 1 mm}")
    faulty = [line.split(": ")[1] for line in problems(text)]
    assert faulty == ["chains", "contact", "gates.impact", "plan.incline"]


@cases
def test_what_a_key_needs_of_both_chains_is_asked_for_of_each(line, lacking):
    told = zip(problems(GOOD.replace("title: on", line)), "AB", strict=True)
    assert all(problem.startswith(lacking % chain) for problem, chain in told)


@pytest.mark.parametrize("order", ["ABBA", "alternate"])
def test_one_chain_takes_no_turns(order):
    two = GOOD.replace("repeats: 4", f"order: {order}")
    text = two.replace("  B: {like: A}\n", "")
    text = text.replace("  free: [{channel: 8, height: 20 mm}]\n", "")
    (line,) = problems(text)
    assert line.startswith(f"f:10:41: plan.order: found {order}, which needs two chains")
    assert parse(two, "f").plan.order == order
    assert parse(text.replace(order, "fixed"), "f").plan.order == "fixed"
    # A session's own copy was accepted once, and cannot be changed any more.
    assert parse(text, "f", kept=True).plan.order == order


def test_proposed_heights_are_clear():
    (line,) = problems(GOOD.replace("20 mm", "230 mm"))
    for height in line.rpartition("heights are ")[2].split(" or "):
        parse(GOOD.replace("20 mm", height))


def test_files_that_cannot_be_read(tmp_path):
    big, binary = tmp_path / "big", tmp_path / "binary"
    big.write_bytes(b"#" * 1_000_001)
    binary.write_bytes("a: µ\nb: ".encode() + b"\xff")
    for path, said in [
        (tmp_path, "is a folder"),
        (tmp_path / "none", "there is no such file"),
        (big, "larger than"),
        (binary, "binary:2:4: not UTF-8"),
        ("a\0b", "cannot be read"),
    ]:
        refused(InputError, said, read, path)


@given(st.binary(max_size=300))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_bytes_give_an_input_error(tmp_path, data):
    path = tmp_path / "any"
    path.write_bytes(data)
    refused(InputError, "", read, os.fspath(path))


PIECES = [
    *": {}[],-#&*!|>'\"%@`?~\n\\",
    *(" ", "  ", "\n  ", "1", "e9", "mm", "±", "&a", "*a", "%YAML 9", "---", "..."),
    *("\\UFFFFFFFF", "\u2028", "\x85", "\0", "\x1b", "\u202e", "1e999", "nan"),
    *("9" * 400, "!!python/object:os.system"),
]


@given(st.integers(0, len(GOOD)), st.integers(0, 30), st.lists(st.sampled_from(PIECES), max_size=8))
@examples(200)
def test_a_damaged_protocol_never_gives_a_traceback(start, cut, pieces):
    text = GOOD[:start] + "".join(pieces) + GOOD[start + cut :]
    try:
        describe(parse(text))
    except InputError as error:
        for line in error.message.split("\nprotocol:"):
            assert_one_block(line)


@given(st.sampled_from(READY), st.data())
@examples(60)
def test_what_is_no_yaml_is_said_in_words_and_shown_with_a_caret(path, data):
    text = path.read_text("utf-8")
    at = data.draw(st.integers(0, len(text) - 1))
    mark = data.draw(st.sampled_from(":{}[],\"'-\t "))
    places = [at, *(n for n, character in enumerate(text) if character == mark)]
    cut = data.draw(st.sampled_from(places)) if data.draw(st.booleans()) else None
    damaged = text[:at] + mark + text[at:] if cut is None else text[:cut] + text[cut + 1 :]
    where = at if cut is None else cut
    assume("#" not in text[: where + 1].rpartition("\n")[2])
    try:
        load(damaged, "f")
    except InputError as error:
        (problem,) = error.problems
        assert_one_block(str(problem))
        assert problem.excerpt.split("\n")[1][4:] in damaged.replace("\t", " ")
        for phrase in ("<", "block end", "token", "expected ", "but found", "scanning", "parsing"):
            assert phrase not in problem.message.replace("unexpected ", "")
        line = text.count("\n", 0, where) + 1
        assert abs(problem.line - line) <= 1 or mark == " "


def assert_one_block(problem):
    """See that a problem is one line, and of what is no YAML that line of it and a caret."""
    head, *below = problem.split("\n")
    if below:
        shown, caret = below
        assert shown.startswith("    ")
        assert caret.strip() == "^"
        assert len(caret) <= len(shown) + 1 <= 80
    assert head.isprintable()
