"""Rigs that are wrong in one thing: that they are rigs, and how what is said of them is counted."""

import json

from bench.studies.diagnoses import LAYOUTS
from bench.studies.wrong_rigs import WRONG_RIGS
from rig.protocol.reader import parse

ONE_OF_A_KIND = LAYOUTS[0], *LAYOUTS[7:]
"""Two chains alike and unlike, a single one, a fence: what other layouts add are gates."""


def test_every_fault_is_of_some_layout_and_another_rig_than_the_stated_one():
    for fault in WRONG_RIGS:
        every = [(one, [*fault.rigs(one.protocol())]) for one in ONE_OF_A_KIND]
        # Each layout's smallest and largest fault: what lies between is made alike.
        rigs = [(one, rig) for one, sizes in every for rig in (*sizes[:1], *sizes[1:][-1:])]
        assert rigs, fault.name
        for layout, (size, text) in rigs:
            assert parse(text).gates is not None
            otherwise = fault.settings(size) or fault.slow(size)
            assert otherwise or json.loads(text) != json.loads(layout.protocol())
