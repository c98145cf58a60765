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


def chains(a, b="like: A"):
    text = protocol_text("five-rods").replace("rods: 5, length: 200 mm", a).replace("like: A", b)
    return parse(text).chains


@cases
def test_a_chain_is_as_it_is_written(a, b, of, has, values, within):
    """Where nothing is computed, to the last bit."""
    found = attrgetter(has)(chains(a, b)[of])
    assert found == pytest.approx(values, rel=within, abs=0.0)


@pytest.mark.parametrize("rods", [2, 8, 15, 29, 57])
def test_a_table_may_end_where_the_chain_does(rods):
    """Whatever rounding the height of the top rod has."""
    table = "[{height: 0 mm, mass: 10 g}, {height: 1165 mm, mass: 3 g}]"
    found = chains(f"rods: {rods}, length: 1165 mm, masses: {{table: {table}}}")["A"]
    assert found.chain.masses[-1] == pytest.approx(0.003, rel=1e-12)


@cases
def test_each_fault_is_found_at_its_place(scene, changes, starts):
    """All at once, and one that is inherited once."""
    text = protocol_text(scene)
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new, 1)
    for problem, start in zip(problems(text), starts, strict=True):
        assert problem.startswith(start)
        assert_one_block(problem)


def test_alias_bombs_and_towers_of_brackets_are_refused():
    lines = ["a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [
        f"{b}: &{b} [{', '.join(['*' + a] * 9)}]" for a, b in zip("abcdef", "bcdefg", strict=True)
    ]
    assert "more than 10000 values" in problems("\n".join(lines))[0]
    assert "or 32 levels" in problems(900 * "[")[0], "before Python's own limit"


def test_an_order_that_one_chain_cannot_take_is_read_where_it_was_accepted_once():
    """In a session's own copy, which cannot be changed any more."""
    text = GOOD.replace("repeats: 4", "order: ABBA").replace("  B: {like: A}\n", "")
    text = text.replace("  free: [{channel: 8, height: 20 mm}]\n", "")
    assert parse(text, "f", kept=True).plan.order == "ABBA"


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
