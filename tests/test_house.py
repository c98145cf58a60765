"""Each room is at most as large as docs/architecture.md says, however its lines are set."""

import ast
import math
import re
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs/architecture.md").read_text("utf-8")
NODES_A_LINE = 11  # what the formatter puts on one line, on average over the project
STALE = 0.95  # of a limit: below that the page has to follow
UNCOUNTED = (ast.expr_context, ast.operator, ast.unaryop, ast.boolop, ast.cmpop)
TOPS = ("rig", "sim", "bench", "firmware", "tests")


@cache
def rooms() -> dict[tuple[str, ...], tuple[int, int]]:
    """Return what each room may have now and what it is to have, by the paths that make it."""
    page = re.sub(r"(?<=\d),(?=\d)", "", PAGE)
    rows = re.findall(r"^\| (`.+`) \| (\d+) \| (\d+) \|$", page, re.MULTILINE)
    return {
        tuple(re.findall(r"`(.+?)`", paths)): (int(now), int(goal)) for paths, now, goal in rows
    }


def is_docstring(node: ast.AST) -> bool:
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


def code_lines(text: str) -> int:
    """Count lines by each statement's own nodes: those of statements inside it are theirs."""
    own: Counter[ast.AST] = Counter()
    rest = [(node, node) for node in ast.parse(text).body]
    while rest:
        node, statement = rest.pop()
        own[statement] += 1
        rest += [
            (child, child if isinstance(child, ast.stmt) else statement)
            for child in ast.iter_child_nodes(node)
            if not isinstance(child, UNCOUNTED)
        ]
    return sum(math.ceil(own[one] / NODES_A_LINE) for one in own if not is_docstring(one))


def room_of(path: str) -> tuple[str, ...]:
    """The room with the longest path that the file's begins with."""
    within = [(len(place), room) for room in rooms() for place in room if path.startswith(place)]
    return max(within)[1]


@pytest.fixture(scope="module")
def counts() -> Counter[tuple[str, ...]]:
    found: Counter[tuple[str, ...]] = Counter()
    for top in TOPS:
        for path in (ROOT / top).rglob("*.py"):
            found[room_of(path.relative_to(ROOT).as_posix())] += code_lines(path.read_text("utf-8"))
    return found


def test_each_room_keeps_to_its_limit(counts):
    over = {room: counts[room] for room, limits in rooms().items() if counts[room] > max(limits)}
    assert not over, "a feature pays for its lines: take some away"
    above = {room: now for room, (now, goal) in rooms().items() if now > goal}
    stale = {room: counts[room] for room, now in above.items() if counts[room] <= STALE * now}
    assert not stale, "write these into the page"


def test_every_room_has_a_limit(counts):
    assert counts.keys() == rooms().keys()
