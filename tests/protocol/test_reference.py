"""The reference of the protocol file against the reader: keys, examples, defaults, the schema."""

import copy
import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import pytest
import yaml

from rig.boards import GATES, RELEASES
from rig.errors import InputError
from rig.protocol import fields, keys
from rig.protocol.keys import KEYS
from rig.protocol.reader import parse
from rig.protocol.reference import page, schema
from rig.protocol.yamltree import load
from tests.protocol.keys import around, put, value
from tests.refusals import refused
from tests.tables import cases, read_table

ROOT = Path(__file__).parents[2]
READY = sorted((ROOT / "protocols").glob("*.yaml"))
BY_PATH = {key.path: key for key in KEYS.values()}


def text(data: dict) -> str:
    return yaml.safe_dump(data, allow_unicode=True, sort_keys=False)


def test_the_table_knows_what_boards_have():
    assert {BY_PATH[f"gates.{side}.[].channel"].accepted for side in ("impact", "free")} == {
        keys.Whole(0, GATES - 1)
    }
    assert BY_PATH["release.channel"].accepted == keys.Whole(0, RELEASES - 1)
    assert BY_PATH["chains.*.rods.[].count"].accepted == keys.Whole(1, keys.MOST_RODS)


VALIDATOR = jsonschema.Draft202012Validator(schema())
VALUED = [key for key in KEYS.values() if key.example]


@pytest.mark.parametrize("key", VALUED, ids=lambda key: key.path)
def test_an_example_is_read_as_it_stands(key):
    data = around(key.path)
    put(data, key.path, value(key.example))
    parse(text(data))
    VALIDATOR.validate(data)


IN_WORDS = read_table(__file__, "in_words")
"""Defaults that follow from something else."""


STATED = [key for key in KEYS.values() if key.default and key.path not in IN_WORDS]


@pytest.mark.parametrize("key", STATED, ids=lambda key: key.path)
def test_a_default_written_is_as_left_out(key):
    """Whatever a protocol is used for: it is the same one, but for its text."""
    plain = around(key.path)
    if "contact" in key.path or key.path == "initial_speed":
        plain["drop"] = "100 mm"
    if ".rods.[]" in key.path:
        plain["chains"]["A"]["rods"] = [{"mass": "3 g"} for _ in range(8)]
    written = copy.deepcopy(plain)
    parent, _, _ = key.path.rpartition(".")
    put(written, key.path, value(key.default))
    if parent and not parent.endswith(("*", "[]")) and parent not in plain:
        put(plain, parent, {})
    assert repr(replace(parse(text(written)), text="")) == repr(
        replace(parse(text(plain)), text="")
    )


def test_a_row_of_the_table_is_all_that_a_key_needs(monkeypatch):
    """The reader, its hints, the page and the schema follow."""
    delay = keys.read_key(("release.delay", "time [0, 3600] s", "2 s", "of the pulse", "5 s"))
    monkeypatch.setattr(keys, "KEYS", KEYS | {delay.path: delay})
    monkeypatch.setitem(keys.SECTIONS["release"], "delay", delay)
    monkeypatch.setitem(fields.DEFAULTS, delay.path, 2.0)

    def release(written: str):
        faults = fields.Faults("f")
        section = fields.Section(load(written, "f"), "release", "release", faults)
        return section["delay"], [str(problem) for problem in faults.problems.values()]

    assert release("{delay: 1 min}") == (60.0, [])
    assert release("{}") == (2.0, [])
    value, (problem,) = release("{delay: -1 s}")
    assert value is None
    assert problem == "f:1:9: release.delay: found -1 s; accepted: 0 s to 3600 s"
    assert "did you mean delay? accepted here: channel, pulse, delay" in release("{dealy: 1}")[1][0]
    assert "| `release.delay` | 0 s to 3600 s | 2 s | of the pulse | `5 s` |" in page()
    assert "delay" in schema()["properties"]["release"]["properties"]


def test_a_default_in_words_is_said_of_keys_that_have_it():
    assert {path: BY_PATH[path].default for path in IN_WORDS} == IN_WORDS


@pytest.mark.parametrize("path", READY, ids=lambda path: path.stem)
def test_ready_protocols_obey_the_schema(path):
    VALIDATOR.validate(yaml.safe_load(path.read_text("utf-8")))


@cases
def test_what_the_reader_refuses_the_schema_refuses(wrong):
    data = {**around("protocol"), **wrong}
    refused(InputError, "", parse, text(data))
    refused(jsonschema.ValidationError, "", VALIDATOR.validate, data)


def test_the_page_and_the_schema_that_are_kept_are_those_of_the_program(capsys):
    from rig.cli import main

    assert main(["check", "--keys"]) == 0
    assert capsys.readouterr().out == page() == (ROOT / "docs/protocol.md").read_text("utf-8")
    assert main(["check", "--schema"]) == 0
    kept = (ROOT / "protocols/protocol.schema.json").read_text("utf-8")
    assert capsys.readouterr().out == kept
    assert json.loads(kept) == schema()
    VALIDATOR.check_schema(VALIDATOR.schema)
