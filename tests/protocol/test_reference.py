"""The reference of the protocol file against the reader: keys, examples, defaults, the schema."""

from __future__ import annotations

import copy
import json
import re
from collections import defaultdict
from pathlib import Path

import jsonschema
import pytest
import yaml

from rig.errors import InputError
from rig.protocol import fields
from rig.protocol.reader import parse, read
from rig.protocol.reference import KEYS, page, schema

ROOT = Path(__file__).parents[2]
READY = sorted((ROOT / "protocols").glob("*.yaml"))
BY_PATH = {key.path: key for key in KEYS}
BARE = {"protocol": 1, "gravity": "9.81 m/s^2", "chains": {"A": {"rods": 8, "length": "350 mm"}}}


def text(data: dict) -> str:
    return yaml.safe_dump(data, allow_unicode=True, sort_keys=False)


def value(example: str) -> object:
    return yaml.safe_load(example)


def around(path: str) -> dict:
    """A protocol in which the key at a path makes sense, without the key itself."""
    data = copy.deepcopy(BARE)
    chain = data["chains"]["A"]
    chain |= {"diameter": "12.7 mm", "rod_length": "100 mm"}
    if path.startswith(("surface", "contact", "gates.impact", "plan.incline")):
        data["surface"] = {"restitution": 0.5}
    if path.startswith("track"):
        data["chains"] = {"A": {"rods": 1}}
        data["track"] = {"incline": "3 deg"}
    if path.startswith("surface.pile"):
        data["surface"]["pile"] = {"below": "30 deg", "restitution": -0.37}
    if path.startswith("plan.order") or path.endswith(".like"):
        data["surface"] = {"restitution": 0.5}
        data["chains"]["B"] = {} if path.endswith(".like") else {"like": "A"}
    if path.startswith("drag"):
        chain["mass"] = "14 g"
        data["drag"] = {} if "terminal" in path else {"coefficient": 1.1}
    if path.startswith("gates"):
        data |= {"drop": "100 mm", "gates": {}}
        sides = ["impact"] if "surface" in data else ["free"]
        data["gates"] = {side: [{"channel": 0, "height": "40 mm"}] for side in sides}
    if "surface" in data:
        data["drop"] = "100 mm"
    if path.startswith("site"):
        del data["gravity"]
        data["site"] = {"latitude": "50 deg", "height": "0 m"}
    if ".rods.[]" in path:
        chain["rods"] = [{"count": 8, "mass": "3 g"}]
        if path.endswith("diameter"):
            del chain["diameter"]
    if ".exponential" in path:
        chain["masses"] = {"exponential": {"bottom": "12 g", "top": "3 g"}}
    if ".table" in path:
        chain["masses"] = {"table": [{"height": f"{z} mm", "mass": "3 g"} for z in (0, 350)]}
    return data


def put(data: dict, path: str, what: object) -> None:
    *way, last = path.split(".")
    here: object = data
    for part in way:
        if part == "*":
            here = here["B" if last == "like" else "A"]
        elif part == "[]":
            here = here[0]
        else:
            here = here.setdefault(part, {})
    here[last] = what


VALUED = [key for key in KEYS if key.example]


@pytest.mark.parametrize("key", VALUED, ids=lambda key: key.path)
def test_an_example_is_read_as_it_stands(key):
    data = around(key.path)
    put(data, key.path, value(key.example))
    parse(text(data))
    jsonschema.validate(data, schema())


@pytest.mark.parametrize(
    "key",
    [key for key in VALUED if re.match(r"-?[0-9]|none|ABBA|false|equal", key.default)
     and not key.default.startswith("1/12")],
    ids=lambda key: key.path,
)  # fmt: skip
def test_a_default_written_is_as_left_out(key):
    def read_without_text(data):
        protocol = parse(text(data))
        return {name: getattr(protocol, name) for name in protocol.__slots__ if name != "text"}

    plain = around(key.path)
    if "contact" in key.path or key.path == "initial_speed":
        plain["drop"] = "100 mm"
    written = copy.deepcopy(plain)
    parent, _, last = key.path.rpartition(".")
    put(written, key.path, value(key.default))
    if parent and not parent.endswith(("*", "[]")) and parent not in plain:
        put(plain, parent, {})
    if key.path.endswith("count"):
        for one in (plain, written):
            one["chains"]["A"]["rods"] = [{"mass": "3 g"} for _ in range(8)]
        written["chains"]["A"]["rods"][0][last] = 1
    assert repr(read_without_text(written)) == repr(read_without_text(plain))


def test_every_key_that_the_reader_knows_is_there(monkeypatch):
    """And none besides: whatever a section accepts, where a file of examples leads to it."""
    seen = defaultdict(set)
    make = fields.Section.__init__

    def noting(self, node, path, faults, accepted, **more):
        general = re.sub(r"\[[0-9]+\]", ".[]", re.sub(r"^chains\.[^.]+", "chains.*", path))
        seen[general] |= set(accepted)
        make(self, node, path, faults, accepted, **more)

    monkeypatch.setattr(fields.Section, "__init__", noting)
    for key in VALUED:
        data = around(key.path)
        put(data, key.path, value(key.example))
        parse(text(data))
    told = defaultdict(set)
    for path in BY_PATH:
        parent, _, name = path.rpartition(".")
        told[parent].add(name)
    assert seen == told


@pytest.mark.parametrize("path", READY, ids=lambda path: path.stem)
def test_ready_protocols_obey_the_schema(path):
    read(path)
    jsonschema.validate(yaml.safe_load(path.read_text("utf-8")), schema())


@pytest.mark.parametrize(
    "wrong",
    [{"gatez": {}}, {"plan": {"repeats": 0}}, {"plan": {"order": "BAAB"}}, {"drop": ["1 m"]},
     {"release": {"channel": 9}}, {"chains": {}}],
)  # fmt: skip
def test_what_the_reader_refuses_the_schema_refuses(wrong):
    data = {**BARE, **wrong}
    with pytest.raises(InputError):
        parse(text(data))
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(data, schema())


def test_the_page_and_the_schema_that_are_kept_are_those_of_the_program(capsys):
    from rig.cli import main

    assert main(["check", "--keys"]) == 0
    assert capsys.readouterr().out == page() == (ROOT / "docs/protocol.md").read_text("utf-8")
    assert main(["check", "--schema"]) == 0
    kept = (ROOT / "protocols/protocol.schema.json").read_text("utf-8")
    assert capsys.readouterr().out == kept
    assert json.loads(kept) == schema()
    jsonschema.Draft202012Validator.check_schema(schema())
