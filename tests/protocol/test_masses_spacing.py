"""Chains whose rods differ: weighed one by one, along a profile, hung at listed distances."""

from fractions import Fraction

import pytest

from rig.errors import InputError
from rig.protocol.reader import parse
from tests.refusals import refused
from tests.tables import cases, protocol_text

SCENE = protocol_text("five-rods")


def scene(a, b="like: A"):
    return SCENE.replace("rods: 5, length: 200 mm", a).replace("like: A", b)


def chains(a, b="like: A"):
    return parse(scene(a, b)).chains


def problems(a, b="like: A"):
    return [str(one) for one in refused(InputError, "", parse, scene(a, b), "f").problems]


def test_masses_rod_by_rod():
    a, b = chains(
        "rods: 5, length: 200 mm, masses: [12 g, 11.5 g, 0.011 kg, 9000 mg, 8 g]"
    ).values()
    assert a.chain.masses == (0.012, 0.0115, 0.011, 0.009, 0.008)
    assert a.weighed
    assert b.chain == a.chain


def test_an_exponential_profile_has_an_even_ratio_and_the_given_ends():
    a = chains("rods: 5, length: 200 mm, masses: {exponential: {bottom: 16 g, top: 1 g}}")["A"]
    assert a.chain.masses == pytest.approx([0.016, 0.008, 0.004, 0.002, 0.001], rel=1e-15)
    assert (a.chain.masses[0], a.chain.masses[-1]) == (0.016, 0.001)
    a = chains("rods: 2, length: 200 mm, masses: {exponential: {bottom: 1 g, top: 3 g}}")["A"]
    assert a.chain.masses == (0.001, 0.003)


def test_a_table_runs_straight_between_its_points():
    table = (
        "[{height: 0 mm, mass: 10 g}, {height: 125 mm, mass: 5 g}, {height: 300 mm, mass: 12 g}]"
    )
    a = chains(f"rods: 5, length: 200 mm, masses: {{table: {table}}}")["A"]
    # At 0, 50, 100, 150 and 200 mm.
    assert a.chain.masses == pytest.approx([0.010, 0.008, 0.006, 0.006, 0.008], rel=1e-14)
    # Points beside the places of the rods are met exactly.
    table = "[{height: 0 mm, mass: 10 g}, {height: 200 mm, mass: 3 g}]"
    masses = chains(f"rods: 5, length: 200 mm, masses: {{table: {table}}}")["A"].chain.masses
    assert (masses[0], masses[-1]) == (0.010, 0.003)


@pytest.mark.parametrize(("inertia", "xi"), [("1/4", 1.0), ("1/12", 1 / 3), ("0.05", 0.2)])
def test_inertia_is_in_units_of_m_times_length_squared(inertia, xi):
    """Weights at the ends, a thin rod, and a ladder of 1/20 m L²: ξ = 4I/(m L²)."""
    assert chains(f"rods: 2, length: 1 m, inertia: {inertia}")["A"].chain.inertia == xi


def test_listed_spacing_places_the_rods():
    a = chains("rods: 5, spacing: [40 mm, 5 cm, 60 mm, 0.07 m]")["A"]
    exact = [sum(map(Fraction, ("0.04", "0.05", "0.06", "0.07")[:k])) for k in range(5)]
    assert a.chain.heights == pytest.approx([float(z) for z in exact], rel=1e-15)


def test_what_a_chain_says_itself_displaces_what_it_inherits():
    _, b = chains(
        "rods: 5, length: 200 mm, mass: 12 g", "like: A, masses: [1 g, 2 g, 3 g, 4 g, 5 g]"
    ).values()
    assert b.chain.masses == (0.001, 0.002, 0.003, 0.004, 0.005)
    _, b = chains("rods: 3, length: 200 mm, masses: [1 g, 2 g, 3 g]", "like: A, mass: 5 g").values()
    assert b.chain.masses == (0.005,) * 3
    _, b = chains("rods: 3, length: 200 mm", "like: A, spacing: [40 mm, 50 mm]").values()
    assert b.chain.heights == (0.0, 0.04, 0.09)
    _, b = chains("rods: 3, spacing: [40 mm, 50 mm]", "like: A, length: 200 mm").values()
    assert b.chain.heights == (0.0, 0.1, 0.2)


@cases
def test_each_fault_of_a_chain_is_found_at_its_place(a, start):
    found = problems(a)
    assert len(found) == 1, found
    assert found[0].startswith(start)


def test_one_object_has_no_profile():
    text = "protocol: 1\nchains: {A: {rods: 1, masses: {exponential: {bottom: 2 g, top: 1 g}}}}"
    (problem,) = refused(InputError, "", parse, text, "f").problems
    assert str(problem).startswith("f:2:32: chains.A.masses.exponential: one object has one mass")


@pytest.mark.parametrize("rods", [2, 8, 15, 29, 57])
def test_a_table_may_end_where_the_chain_does(rods):
    """Whatever rounding the height of the top rod has."""
    table = "[{height: 0 mm, mass: 10 g}, {height: 1165 mm, mass: 3 g}]"
    found = chains(f"rods: {rods}, length: 1165 mm, masses: {{table: {table}}}")["A"]
    assert found.chain.masses[-1] == pytest.approx(0.003, rel=1e-12)
