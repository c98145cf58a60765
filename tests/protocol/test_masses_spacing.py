"""Chains whose rods differ: weighed one by one, along a profile, hung at listed distances."""

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


def test_a_chain_is_weighed_rod_by_rod_and_inherited():
    a, b = chains("rods: 2, length: 200 mm, masses: [12 g, 11.5 g]").values()
    assert a.weighed
    assert b.chain == a.chain
    a = chains("rods: 5, length: 200 mm, masses: {exponential: {bottom: 16 g, top: 1 g}}")["A"]
    assert (a.chain.masses[0], a.chain.masses[-1]) == (0.016, 0.001)


@cases
def test_a_chain_is_as_it_is_written(a, b, of, has, values, within):
    """Where nothing is computed, to the last bit."""
    found = getattr(chains(a, b)[of].chain, has)
    assert found == pytest.approx(values, rel=within, abs=0.0)


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
