"""Every shape of one truth is read as the truth, and no mutant of it as anything else."""

from __future__ import annotations

import random
import re
from argparse import Namespace

import pytest

from rig.commands.import_edges import read_with_protocol
from rig.errors import InputError
from rig.protocol import reader
from rig.timers.edges_csv import TICK_HZ
from tests.timers.shapes import PROTOCOL, Shape, shapes

SHAPES = shapes()
TRANSLATIONS = {
    "time": ("zeit", "temps", "tempo", "tiempo"),
    "gate": ("lichtschranke", "porte", "fotocellula", "puerta"),
    "state": ("zustand", "état", "stato", "estado"),
    "run": ("lauf", "essai", "prova", "ensayo"),
    "blocked": ("unterbrochen", "bloqué", "bloccato", "bloqueado"),
    "channel": ("kanal", "canal", "canale", "voie"),
}
BACK = {word: name for name, listed in TRANSLATIONS.items() for word in listed}


def options(path, *more: str) -> Namespace:
    values = {"events": str(path), "unit": None, "dark": None, "map": None, "map_file": None,
              "channel": None, "as_read": False, "allow_unused": False}  # fmt: skip
    for name, value in zip(more[::2], more[1::2], strict=True):
        values[name.strip("-")] = int(value) if value.isdecimal() else value
    return Namespace(**values)


def read(path, content: bytes, shape: Shape):
    """Return the edges of each run."""
    path.write_bytes(content)
    drops, *_ = read_with_protocol(reader.read(str(PROTOCOL)), options(path, *shape.options))
    return [[(edge.tick / TICK_HZ, edge.channel, edge.blocked) for edge in drop.edges]
            for drop in drops]  # fmt: skip


def _span(edges) -> float:
    return edges[-1][0] - edges[0][0]


def differs(runs, shape: Shape, deleted: int = 0) -> str:
    """Say in what runs are not the truth, of which some edges may be left out with their rows."""
    within = max(2e-6, 2 * shape.sampled)
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


def mutant(shape: Shape, seed: int) -> tuple[bytes, int, str]:
    """Delete rows, exchange columns or translate headings; say how many edges may be missing."""
    rng = random.Random(seed)
    encoding = next(
        (name for name, start in (("utf-16", b"\xff\xfe"), ("utf-16-le", b"L\0"))
         if shape.content.startswith(start)), "utf-8")  # fmt: skip
    try:
        text = shape.content.decode(encoding)
    except UnicodeDecodeError:
        encoding = "cp1252"
        text = shape.content.decode(encoding)
    lines = text.splitlines()
    data = [n for n, line in enumerate(lines) if n > 2 and re.search(r"[0-9]{3}", line)]
    kind = rng.choice(("delete", "exchange", "translate"))
    deleted = 0
    if kind == "delete" and data:
        for n in sorted(rng.sample(data, rng.randint(1, min(2, len(data)))), reverse=True):
            del lines[n]
            deleted += 3 * (not shape.sampled)
    elif kind == "exchange":
        separator = next((s for s in "\t;," if text.count(s) > len(lines)), " ")
        width = max(line.count(separator) for line in lines) + 1
        order = rng.sample(range(width), width)
        for n, line in enumerate(lines):
            cells = line.split(separator)
            if len(cells) == width and '"' not in line:
                lines[n] = separator.join(cells[k] for k in order)
        if any('"' in line for line in lines):
            lines = text.splitlines()
    else:
        language = rng.randrange(4)
        pairs = [(word, listed[language]) for word, listed in TRANSLATIONS.items()]
        lines = [_translate(line, pairs) for line in lines]
        back = [(word, name) for word, name in BACK.items() if rng.random() < 0.5]
        lines = [_translate(line, back) for line in lines]
    return ("\n".join(lines) + "\n").encode(encoding, "replace"), deleted, kind


def _translate(line: str, pairs) -> str:
    for word, other in pairs:
        line = re.sub(rf"(?i)(?<![^\W\d_]){word}(?![^\W\d_])", other, line)
    return line


def wrong_mutants(path, name: str, seeds) -> list[str]:
    found = []
    for seed in seeds:
        shape = SHAPES[name]
        content, deleted, kind = mutant(shape, seed)
        try:
            runs = read(path, content, shape)
        except InputError:
            continue
        if why := differs(runs, shape, deleted):
            found.append(f"seed {seed}, {kind}: {why}")
    return found


SMALL = [name for name, shape in SHAPES.items() if not shape.sampled]


@pytest.mark.parametrize("name", SMALL)
def test_no_mutant_is_read_as_another_truth(tmp_path, name):
    assert wrong_mutants(tmp_path / "file", name, range(4)) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", SHAPES)
def test_none_of_many_mutants_is_read_as_another_truth(tmp_path, name):
    assert wrong_mutants(tmp_path / "file", name, range(100)) == []
