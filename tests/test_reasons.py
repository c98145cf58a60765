"""Every code that is raised stands in the one table, and every code of the table is raised."""

import ast
import re
import sqlite3
from functools import cache
from pathlib import Path

from rig.errors import RigError
from rig.link.messages import DisarmReason, RefusalReason
from rig.reasons import _PHRASES, WORDINGS, make_reason, rig_error
from rig.vocabulary import VOCABULARIES, Vocabulary
from tests.tables import cases

RIG = Path(__file__).parents[1] / "rig"
RAISERS = {"make_reason": 0, "rig_error": 0, "plain_reason": 1, "problem": 1,
           "CheckFailedError": 0, "NotPossibleError": 0, "problems.add": 3, "_problems.add": 3,
           "place.add": 1, "problems.refuse": 1, "refusal": 1, "errors_become": 0}  # fmt: skip
"""Functions that take a code, and which of their arguments it is."""
REFUSED = {f"refused_{reason.name.lower()}" for reason in RefusalReason}
SQLITE = {name.lower() for name in dir(sqlite3) if name.startswith("SQLITE_")}
DISARMED = {f"disarmed_{reason.name.lower()}" for reason in DisarmReason}


@cache
def trees():
    paths = [path for path in RIG.rglob("*.py") if path.name != "reasons.py"]
    return [(path, ast.parse(path.read_text("utf-8"))) for path in paths]


def texts(tree):
    return {
        node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }


def name_of(node):
    """The last name of what is called, or of what that is of."""
    return getattr(node, "attr", getattr(node, "id", ""))


@cache
def raised_codes():
    """Codes that calls name, with the file and the call that does."""
    raised = []
    for path, tree in trees():
        for call in ast.walk(tree):
            if not isinstance(call, ast.Call):
                continue
            last, before = name_of(call.func), name_of(getattr(call.func, "value", None))
            at = RAISERS.get(last, RAISERS.get(f"{before}.{last}"))
            if at is not None and len(call.args) > at:
                raised += [(path, text, call) for text in texts(call.args[at])]
    return raised


def test_each_raised_code_is_in_the_table():
    assert not {(path.name, code) for path, code, _ in raised_codes() if code not in WORDINGS}
    assert set(WORDINGS) >= REFUSED | DISARMED


def given(call, tree):
    """Names of the values that a call gives, also by ``**values`` of a dictionary in its file."""
    names = {keyword.arg for keyword in call.keywords if keyword.arg}
    by_name = {ast.unparse(keyword.value) for keyword in call.keywords if not keyword.arg}
    dictionaries = [
        (ast.unparse(target), texts(node.value))
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Dict)
        for target in node.targets
    ]
    names = names.union(*(keys for name, keys in dictionaries if name in by_name))
    return names, by_name - {name for name, _ in dictionaries}


ROOMS = ("daemon", "recorder", "session", "link")
DECODED = {"DeviceRefusedError", "MessageError"}
"""The one takes its code from the device's reason; the other says why bytes are no message."""


def kinds(kind=RigError):
    return {kind.__name__}.union(*map(kinds, kind.__subclasses__()))


def test_whatever_rig_and_session_refuse_has_a_code():
    plain = {
        (str(path.relative_to(RIG)), call.lineno)
        for path, tree in trees()
        if path.relative_to(RIG).parts[0] in ROOMS
        for call in ast.walk(tree)
        if isinstance(call, ast.Call)
        and ast.unparse(call.func).rpartition(".")[2] in kinds() - DECODED
    }
    assert not plain


def test_an_error_has_the_sentence_and_the_remedy_of_its_code():
    error = rig_error("session_in_use", path="a.session", holder="process 7")
    assert str(error).startswith("a.session is being written by process 7\n  hint: stop that ")
    assert [reason.code for reason in error.reasons] == ["session_in_use"]


def test_each_call_gives_what_its_sentence_and_remedy_need():
    words = set(_PHRASES) | set(Vocabulary._fields)
    lacking, parsed = {}, dict(trees())
    for path, code, call in raised_codes():
        values, unseen = given(call, parsed[path])
        if name_of(call.func) in {"plain_reason", "errors_become"}:
            values.add("text")
        if not unseen:  # by a name that no dictionary of the file has, ** may hold any
            wording = WORDINGS[code]
            places = re.findall(r"(?<!\{)\{(\w+)", wording.sentence + wording.remedy)
            if missing := set(places) - values - words:
                lacking[path.name, call.lineno] = missing
    assert not lacking


def test_each_code_of_the_table_is_raised():
    somewhere = set().union(*(texts(tree) for _, tree in trees()))
    somewhere |= {"operator", "note", "sentence"} | REFUSED | DISARMED | SQLITE
    assert set(WORDINGS) <= somewhere


def test_each_code_has_a_plain_sentence():
    for code, wording in WORDINGS.items():
        assert wording.sentence, code
        assert not wording.sentence.endswith("."), code
        said = wording.sentence + wording.remedy
        assert not re.search(r"\bshall\b|\blest\b|\bas well may\b", said), code


@cases
def test_a_reason_is_said_in_the_words_of_its_scene(scene, code, values, sentence):
    reason = make_reason(code, VOCABULARIES[scene], **values)
    assert (reason.text, reason.json()["values"]) == (sentence, values)
