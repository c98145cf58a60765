"""Every shape of one truth is read as the truth, and no mutant of it as anything else."""

from __future__ import annotations

from argparse import Namespace

import pytest

from rig.commands.import_edges import import_with_protocol
from rig.errors import InputError
from rig.protocol import reader
from rig.timers.moments import TICK_HZ
from tests.analysis.drops import SCENES, case
from tests.timers.mutations import mutate
from tests.timers.shapes import PROTOCOL, RUNS, Shape, run, shapes, table
from tests.timers.strangers import NOT_READ, REFUSED, strangers

SHAPES = shapes()
PARSED = reader.read(str(PROTOCOL))
STRANGERS = strangers()


def options(path, *more: str) -> Namespace:
    values = {"events": str(path), "unit": None, "dark": None, "map": None, "map_file": None,
              "channel": None, "as_read": False, "allow_unused": False}  # fmt: skip
    for name, value in zip(more[::2], more[1::2], strict=True):
        values[name.strip("-")] = int(value) if value.isdecimal() else value
    return Namespace(**values)


def read(path, content: bytes, shape: Shape):
    """Return the edges of each run."""
    path.write_bytes(content)
    drops = import_with_protocol(PARSED, options(path, *shape.options)).drops
    return [[(edge.tick / TICK_HZ, edge.channel, edge.blocked) for edge in drop.edges]
            for drop in drops]  # fmt: skip


def _span(edges) -> float:
    return edges[-1][0] - edges[0][0]


def differs(runs, shape: Shape, deleted: int = 0) -> str:
    """Say in what runs are not the truth, of which some edges may be left out with their rows."""
    within = max(2e-6, (2 + shape.bare * deleted) * shape.sampled)
    missing = 0
    if not 0 <= len(shape.truth) - len(runs) <= bool(deleted) * 2:
        return f"{len(runs)} runs"
    left = [truth for truth in shape.truth if any(set(got[0][1:]) for got in runs)]
    if len(runs) < len(left):  # whole runs may stand in a row
        left = [min(left, key=lambda truth: abs(_span(truth) - _span(got))) for got in runs]
    for got, truth in zip(runs, left, strict=True):
        offsets = [got[0][0] - time for time, channel, dark in truth
                   if (channel, dark) == got[0][1:]]  # fmt: skip
        strange = [
            [edge for edge in got if not any(
                edge[1:] == true[1:] and abs(edge[0] - true[0] - offset) < within
                for true in truth)]
            for offset in offsets
        ]  # fmt: skip
        if not strange or min(map(len, strange)):
            return f"edges that are none: {strange[:1]}"
        missing += len(truth) - len(set(got))
    return "" if 0 <= missing <= deleted else f"{missing} edges are missing"


@pytest.mark.parametrize("name", SHAPES)
def test_every_shape_is_read_as_the_truth(tmp_path, name):
    shape = SHAPES[name]
    assert differs(read(tmp_path / "file", shape.content, shape), shape) == ""


def try_reading(path, content: bytes, shape: Shape):
    """Return the edges of each run, or nothing and what the refusal advises."""
    try:
        return read(path, content, shape), ""
    except InputError as error:
        return None, error.hint


def read_mutants(path, name: str, seeds) -> dict[str, list[str]]:
    """Sort mutants of a shape by what becomes of them: read, refused, or wrong."""
    outcomes: dict[str, list[str]] = {"read": [], "refused": [], "wrong": []}
    for seed in seeds:
        shape, mutant = SHAPES[name], mutate(SHAPES[name].content, seed)
        runs, advice = try_reading(path, mutant.content, shape)
        label = f"seed {seed}, {mutant.kind}"
        if runs is None:
            assert advice
            outcomes["refused"].append(label)
            continue
        runs = [[(time / mutant.scale, *rest) for time, *rest in edges] for edges in runs]
        why = differs(runs, shape, mutant.deleted)
        outcomes["wrong" if why else "read"].append(f"{label}: {why}" if why else label)
    return outcomes


@pytest.mark.parametrize(
    ("name", "seeds"),
    [
        *((name, range(4)) for name, shape in SHAPES.items() if not shape.sampled),
        *(pytest.param(name, range(4, 100), marks=pytest.mark.slow) for name in SHAPES),
    ],
)
def test_no_mutant_is_read_as_another_truth(tmp_path, name, seeds):
    assert not read_mutants(tmp_path / "file", name, seeds)["wrong"]


def test_a_row_with_a_single_time_is_no_drop(tmp_path):
    shape = STRANGERS["Times of gates with NaN"]
    lines = shape.content.splitlines()
    del lines[7], lines[5]
    runs, _ = try_reading(tmp_path / "file", b"\n".join(lines), shape)
    assert runs is None or len(runs) == 1


@pytest.mark.parametrize("gone", range(1, 9))
def test_a_copy_that_lacks_a_row_is_a_copy(tmp_path, gone):
    lines = STRANGERS["Twice the same"].content.splitlines(keepends=True)
    runs, advice = try_reading(tmp_path / "file", b"".join(lines[:gone] + lines[gone + 1 :]),
                               STRANGERS["Twice the same"])  # fmt: skip
    assert runs is None
    assert "copy" in advice


def test_a_run_that_is_unlike_many_others_is_named(tmp_path):
    protocol, file = tmp_path / "protocol.yaml", tmp_path / "file"
    text = PROTOCOL.read_text("utf-8").replace("repeats: 10", "repeats: 300")
    protocol.write_text(text, "utf-8")
    edges = [(n, *edge) for n in range(1, 301) for edge in run(0.3 + 1e-4 * n)]
    rows = table([n, c, f"{t * (1.7 if n == 152 else 1):.6f}", int(d)] for n, t, c, d in edges)
    file.write_text("run,gate,time (s),state\n" + rows, "utf-8")
    with pytest.raises(InputError, match="run 152:"):
        import_with_protocol(reader.read(str(protocol)), options(file))


@pytest.mark.parametrize("name", ["{}", "D{}", "{:c}"])
def test_gates_of_a_chain_may_be_numbered_from_another_number(tmp_path, name):
    """Its rods hang in the upper beams, so the first edges say nothing of the gates' order."""
    drop, file = case(SCENES["single"]).drop, tmp_path / "file"
    gates = [name.format(65 + edge.channel if "c" in name else 1 + edge.channel)
             for edge in drop.edges]  # fmt: skip
    rows = table([gate, f"{edge.tick / drop.tick_hz:.6f}", int(edge.blocked)]
                 for gate, edge in zip(gates, drop.edges, strict=True))  # fmt: skip
    file.write_text("gate,time (s),state\n" + rows, "utf-8")
    (read,) = import_with_protocol(SCENES["single"], options(file)).drops
    assert [edge[1:] for edge in read.edges] == [edge[1:] for edge in drop.edges]


def test_a_run_that_has_another_number_here_is_named(tmp_path):
    file = tmp_path / "file"
    rows = table([n, c, f"{t:.6f}", int(d)] for n, edges in enumerate(RUNS) for t, c, d in edges)
    file.write_text("run,gate,time (s),state\n" + rows, "utf-8")
    imported = import_with_protocol(PARSED, options(file))
    assert [drop.run for drop in imported.drops] == [1, 2, 3]
    assert any("0 is run 1, 1 is run 2, 2 is run 3" in note.text for note in imported.notes)


@pytest.mark.parametrize("name", STRANGERS)
def test_what_a_stranger_writes_is_read_rightly_or_refused_with_advice(tmp_path, name):
    shape = STRANGERS[name]
    runs, advice = try_reading(tmp_path / "file", shape.content, shape)
    assert (runs is None) is (name in NOT_READ)
    assert advice if runs is None else not differs(runs, shape)


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_timer_s_file_is_refused(tmp_path, name):
    runs, advice = try_reading(tmp_path / "file", REFUSED[name], Shape(b"", []))
    assert runs is None
    assert advice
