"""The table of unknowns: what its rows do, and that all else follows from them."""

from dataclasses import replace

import numpy as np
import pytest

from bench.studies.layout_catalogue import KINDS, STANDARD, Kind, under
from rig.analysis import drop_model, unknowns
from rig.analysis.drop_model import DropModel
from rig.analysis.joint_fit import joint_fit
from rig.analysis.unknowns import TABLE, Unknown, Unknowns
from rig.protocol import reader
from rig.units import Quantity
from tests.analysis.drops import PROTOCOLS, SCENES, case
from tests.analysis.sessions import cases, fits

THIN = next(kind for kind in KINDS if kind.name == "thin at the top")
UNLIKE = under(Kind("unlike", THIN.chain, other=STANDARD.chain), (0.2, 0.65), (0.18, 0.6))
ALL = SCENES | {
    "ball": reader.read(PROTOCOLS / "falling-ball.yaml"),
    "glider": reader.read(PROTOCOLS / "glider.yaml"),
    "unlike": reader.parse(UNLIKE.protocol()),
}


def model_of(scene: str) -> DropModel:
    return case(ALL[scene], seed=2).model()[0]


def gates_moved(protocol, which, by):
    gates = [
        replace(gate, height=gate.height + by * which(number, gate))
        for number, gate in enumerate(protocol.gates.gates)
    ]
    return replace(protocol, gates=replace(protocol.gates, gates=tuple(gates)))


def chain_changed(protocol, name, rod, higher, wider):
    old = protocol.chains[name]
    heights = tuple(height + higher * (n == rod) for n, height in enumerate(old.chain.heights))
    widths = tuple(width + wider for width in old.widths)
    new = replace(old, chain=replace(old.chain, heights=heights), widths=widths)
    return replace(protocol, chains={**protocol.chains, name: new})


@pytest.mark.parametrize("scene", ["uniform", "unlike", "single", "fence"])
def test_a_row_does_what_another_protocol_does(scene):
    """A rig that is otherwise, described by a protocol, has the path and levels that x has."""
    one, by = case(ALL[scene], seed=2), 1e-4
    model = one.model()[0]
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
        x = np.zeros(len(at))
        x[range(len(at))[at[name]][member]] = by
        other = DropModel(
            protocol, replace(one, protocol=protocol).records, model.guesses, one.scale.u
        )
        for role in model.records:
            if name in {"impact rods", "impact width", "free rods", "free width"} - {
                f"{role} rods",
                f"{role} width",
            }:
                continue  # chains that are like each other are one chain in the protocol
            levels = model.all_levels(role, x)
            np.testing.assert_allclose(
                levels, other.all_levels(role, np.zeros(len(at))), rtol=0, atol=1e-12
            )
            path = model.trajectory(role, x)
            times = np.linspace(path.time[0], path.time[-1] + 0.1, 50)
            expected = other.trajectory(role, np.zeros(len(at))).heights(times)[0]
            np.testing.assert_allclose(path.heights(times)[0], expected, rtol=0, atol=1e-12)


def test_what_only_its_row_says_is_in_priors_equations_budget_and_joint_fit(monkeypatch):
    lag = Unknown(
        "lag",
        "edges",
        lambda _: 1e-3,
        of="each",
        shared="chain",
        level=lambda side: side.edges.sign,
    )
    drops = cases((1, 2, 3, 4))
    without = fits(drops)
    monkeypatch.setattr(unknowns, "TABLE", (*TABLE, lag))
    drop_model._model_of.cache_clear()  # what was made by the other table
    try:
        found = fits(drops)
        joint = joint_fit(found)
    finally:
        drop_model._model_of.cache_clear()
    for fit, old in zip(found, without, strict=True):
        at = fit.model.unknowns
        assert len(at) == len(old.model.unknowns) + 2
        for role in fit.model.records:
            assert at.sd[at[f"{role} lag"]] == pytest.approx(1e-3)
            assert at[f"{role} lag"] in at.groups["edges"]
            equations = fit.model.equations(role, fit.x, fit.matches[role])
            of_width, of_lag = (
                equations.slopes[:, equations.columns == at[f"{role} {name}"].start]
                for name in ("width", "lag")
            )
            np.testing.assert_allclose(of_lag, -of_width)
            assert of_lag.any()
    assert joint.settled
    assert {"A lag", "B lag"} <= joint.shared.blocks.keys()


def test_what_a_drop_has_of_its_own_is_shared_by_none():
    """Gravity is the rig's, unless it is what is measured: then each drop has its own."""
    for scene, shared in (("uniform", "rig"), ("single", "rig"), ("fence", "drop")):
        assert Unknowns(model_of(scene)).rows["gravity"].shared == shared
