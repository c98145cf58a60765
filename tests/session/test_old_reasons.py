"""Files of before codes hold sentences: each is kept as it was said, and taken for no code."""

from __future__ import annotations

import json

import pytest

from rig.session.reason_rows import read_reasons

SENTENCES = {
    "note: the lamp flickered": ("note", "the lamp flickered"),
    "69 of 202 edges unexplained (34.2%), more than 10.0%":
        ("sentence", "69 of 202 edges unexplained (34.2%), more than 10.0%"),
}  # fmt: skip
"""As version 0.1 wrote them, and what is read: a code, and its text."""


@pytest.mark.parametrize("sentence", SENTENCES)
def test_a_sentence_of_an_old_file_is_read_as_it_stands(sentence):
    (reason,) = read_reasons(json.dumps([sentence]))
    code, text = SENTENCES[sentence]
    assert (reason.code, reason.values["text"]) == (code, text)
