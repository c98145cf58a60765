"""The table of unknowns: each row does what another protocol does."""

from dataclasses import replace

import numpy as np
import pytest

from bench.studies.layout_catalogue import KINDS, STANDARD, Kind, under
from rig.analysis.components import above
from rig.analysis.drop_model import DropModel
from rig.model.chain import Chain
from rig.protocol import reader
from rig.units import Quantity
from tests.analysis.drops import SCENES, case

THIN = next(kind for kind in KINDS if kind.name == "thin at the top")
UNLIKE = under(Kind("unlike", THIN.chain, other=STANDARD.chain), (0.2, 0.65), (0.18, 0.6))
ALL = SCENES | {"unlike": reader.parse(UNLIKE.protocol())}


def gates_moved(protocol, which, by):
    gates = [
        replace(gate, height=gate.height + by * which(number, gate))
        for number, gate in enumerate(protocol.gates.gates)
    ]
    return protocol.with_gates(gates)


def chain_changed(protocol, name, rod, higher, wider):
    old = protocol.chains[name]
    heights = tuple(height + higher * (n == rod) for n, height in enumerate(old.chain.heights))
    widths = tuple(width + wider for width in old.widths)
    new = replace(old, chain=replace(old.chain, heights=heights), widths=widths)
    return replace(protocol, chains={**protocol.chains, name: new})


def test_the_mass_above_a_rod_counts_in_units_of_its_own():
    assert above(Chain((1.0, 2.0, 4.0), (0.0, 0.1, 0.3))).tolist() == [6.0, 2.0, 1.0]


@pytest.mark.parametrize("scene", ["uniform", "unlike", "single", "fence"])
def test_a_row_does_what_another_protocol_does(scene):
    """A rig that is otherwise, described by a protocol, has the path and levels that x has."""
    one, by = case(ALL[scene], seed=2), 1e-4
    model, _, fall = one.model()
    at, protocol = model.unknowns, one.protocol
    post = protocol.gates.posts[-1]
    rigs = {
        ("drop", 0): replace(protocol, drop=Quantity(protocol.drop.value + by)),
        ("gravity", 0): replace(protocol, gravity=Quantity(protocol.gravity.value + by)),
        ("beams", 0): gates_moved(protocol, lambda n, _: n == 0, by),
        ("datum", -1): gates_moved(protocol, lambda _, gate: gate.side == post, by),
    }
    for role, record in model.records.items():
        name = record.chain.name
        rigs[f"{role} width", 0] = chain_changed(protocol, name, 0, 0.0, by)
        rigs[f"{role} rods", -1] = chain_changed(protocol, name, record.chain.chain.rods - 1, by, 0)
    for (name, member), protocol in rigs.items():
        x = np.where(at.flat, fall, 0.0)
        before = x.copy()
        x[range(len(at))[at[name]][member]] = by
        other = DropModel(protocol, replace(one, protocol=protocol).records, one.scale.u)
        for role in model.records:
            if name in {"impact rods", "impact width", "free rods", "free width"} - {
                f"{role} rods",
                f"{role} width",
            }:
                continue  # chains that are like each other are one chain in the protocol
            levels = model.all_levels(role, x)
            np.testing.assert_allclose(levels, other.all_levels(role, before), rtol=0, atol=1e-12)
            path = model.trajectory(role, x)
            times = np.linspace(path.time[0], path.time[-1] + 0.1, 50)
            expected = other.trajectory(role, before).heights(times)[0]
            np.testing.assert_allclose(path.heights(times)[0], expected, rtol=0, atol=1e-12)
