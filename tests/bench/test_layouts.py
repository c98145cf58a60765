"""Layouts of gates: that all are protocols, and that void and wrong are counted by the truth."""

import pytest

from bench.studies.layout_catalogue import LAYOUTS
from rig.protocol.measurable import unmeasurable
from rig.protocol.reader import parse


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda one: f"{one.kind.name}: {one.heights}")
def test_every_layout_is_a_protocol_that_can_be_measured(layout):
    protocol = parse(layout.protocol())
    assert not unmeasurable(protocol)
    assert len(protocol.gates.gates) == len(layout.impact) + len(layout.free)
    assert (protocol.surface is None) == (layout.kind.scene == "fence")
    assert protocol.two_chains == (layout.kind.scene == "two")
