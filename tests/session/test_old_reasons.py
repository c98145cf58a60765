"""Files of before codes hold sentences: each is still read as the reason that it was."""

from __future__ import annotations

import json

import pytest

from rig.reasons import remedies
from rig.session.reason_rows import read_reasons

UNCLEAR = "likeliest, but not clearly: gravity is 0.99% ± 0.28% less than the protocol says; or …"
SENTENCES = {
    "69 of 202 edges unexplained (34.2%), more than 10.0%": "edges_unexplained",
    "1 of 8 edges unexplained (12.5%), more than 10.0%, which may be one stray pulse":
        "edges_unexplained_few",
    "4 edges after the passage were left out: it came back": "later_passages",
    "15 of 200 edges missed (7.5%), more than 5.0%": "edges_missed",
    "4 of 64 edges missed (6.2%), more than 5.0%, which of so few edges may be chance":
        "edges_missed_few",
    "chain A has 26 rods, not 25 as the protocol says (odds 293 to 1)": "rod_count",
    "the gate on channel 1 (impact side, 70 mm) gave no edges: dead or not plugged in":
        "gate_silent",
    "the free side's post is 4.9 ± 1.8 mm higher than the protocol says (odds 527 to 1)": "post",
    UNCLEAR: "unclear_fault",
    "chain A hangs upside down on the impact side (odds more than 10000 to 1)": "upside_down",
    "something that no version ever said": "sentence",
}  # fmt: skip
"""As version 0.1 wrote them, and their codes of today."""


@pytest.mark.parametrize("sentence", SENTENCES)
def test_a_sentence_of_an_old_file_is_read_as_its_reason(sentence):
    (reason,) = read_reasons(json.dumps([sentence]))
    assert (reason.code, str(reason)) == (SENTENCES[sentence], sentence)
    assert remedies([reason]) or reason.code == "later_passages"
