"""Files of before codes hold sentences: each is kept as it was said, and taken for no code."""

import json

import pytest

from rig.session.schema import read_reasons


@pytest.mark.parametrize(
    ("sentence", "code"),
    [("note: the lamp flickered", "note"), ("69 of 202 edges unexplained (34.2%)", "sentence")],
)
def test_a_sentence_of_an_old_file_is_read_as_it_stands(sentence, code):
    (reason,) = read_reasons(json.dumps([sentence]))
    assert (reason.code, reason.values["text"]) == (code, sentence.removeprefix("note: "))
