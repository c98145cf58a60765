"""Every point of a sweep is the single fall there, and what stands behind --vary."""

import itertools
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.errors import DomainError, InputError
from rig.model.fall import fall
from rig.model.impact import impact_on
from rig.model.surface import Surface
from rig.protocol import reader
from rig.sweep.compute import ABOVE_HALF, NO_ANSWER, NOT_SLIDING, PILE, compute
from rig.sweep.layout import MOST_POINTS, lay_out, linspace, read_vary
from rig.sweep.variables import VARIABLES
from rig.units import Quantity
from tests.cli.lab import PROTOCOLS
from tests.refusals import refused
from tests.sweep.conftest import SCENE, VARY
from tests.tables import cases


def points(protocol, vary, length=7):
    """Lay a sweep out and give every point: its parameters and results."""
    layout = lay_out(protocol, vary)
    with ThreadPoolExecutor(1) as pool:
        swept = compute(layout, pool, 1, length)
    assert swept.notes.shape == layout.shape
    names = list(layout.axes)
    rows = zip(
        itertools.product(*layout.axes.values()),
        swept.separation_m.ravel().tolist(),
        swept.speed_m_s.ravel().tolist(),
        swept.in_domain.ravel().tolist(),
        swept.notes.ravel().tolist(),
        strict=True,
    )
    for values, *found in rows:
        yield {**layout.fixed_values, **dict(zip(names, values, strict=True))}, *found


def test_points_are_single_falls_with_the_notes_of_single_impacts():
    protocol = reader.parse(SCENE)
    chain = protocol.chains["A"].chain
    seen = 0
    for at, separation, speed, in_domain, notes in points(protocol, VARY):
        seen |= notes
        one = replace(chain, inertia=4.0 * at["inertia"])  # ξ = 4I/(mL²)
        surface = Surface(
            Quantity(at["restitution"]), Quantity(at["friction"]), protocol.surface.pile
        )
        try:
            impact = impact_on(surface, one, at["incline"])
        except DomainError:
            assert notes == NO_ANSWER
            assert np.isnan([separation, speed]).all()
            assert not in_domain
            continue
        told = "; ".join(impact.notes)
        assert bool(notes & NOT_SLIDING) == ("slide" in told)
        assert bool(notes & ABOVE_HALF) == ("above ½" in told)
        assert bool(notes & PILE) == (impact.basis == "pile")
        assert in_domain == (not told)
        alone = fall(one, impact.alpha, impact.gamma, at["drop"], at["gravity"])
        # α rests on sines, whose last digit is numpy's here and the C library's there.
        wanted = alone.separation_m + (0.65 - 0.6), alone.speed_m_s
        assert (separation, speed) == pytest.approx(wanted, rel=1e-12, abs=1e-15)
        if impact.basis in {"pile", "level"}:
            assert (separation, speed) == wanted
    assert seen == NOT_SLIDING | ABOVE_HALF | NO_ANSWER | PILE


@cases
def test_only_what_the_scene_has_can_be_varied(scene, vary, said):
    refused(InputError, said, lay_out, reader.read(PROTOCOLS / scene), [vary])


def test_air_is_refused_rather_than_left_out():
    protocol = reader.parse(SCENE + "drag: {terminal_speed: 20 m/s}\n")
    refused(InputError, "drag", lay_out, protocol, ["friction=0..1:3"])


def test_too_many_points_are_refused_before_they_are_computed():
    vary = ["friction=0..1:3000", f"drop=0m..1m:{MOST_POINTS // 9000 + 1}"]
    refused(InputError, f"at most {MOST_POINTS}", lay_out, reader.parse(SCENE), vary)


NAMES = tuple(VARIABLES)
SPACES = st.sampled_from(["", " ", "  "])


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.integers(2, 40), st.lists(SPACES, min_size=5))
def test_a_range_is_read_as_written(one, other, count, spaces):
    low, high = sorted((one, other))
    if low == high:
        low, high = -1.0, 1.0
    parts = ["restitution", "=", repr(low), "..", repr(high), ":", str(count)]
    for place, space in enumerate(spaces[:4]):
        parts[2 * place] = f"{space}{parts[2 * place]}{spaces[-1]}"
    assert read_vary(["".join(parts)], NAMES) == {"restitution": linspace(low, high, count)}


@given(st.text(alphabet="restiuon=.:0123456789-e mdg±", max_size=30))
def test_any_text_is_read_or_refused_in_one_line(text):
    try:
        found = read_vary([text], NAMES)
    except InputError as error:
        problem = error.message
    else:
        assert all(len(values) > 1 for values in found.values())
        return
    assert len(problem.splitlines()) == 1


def test_units_lead_to_si_and_degrees():
    found = read_vary(["drop=100mm..300 mm:3", "incline=0deg..80deg:3", "friction=0.1"], NAMES)
    assert found == {"drop": (0.1, 0.2, 0.3), "incline": (0.0, 40.0, 80.0), "friction": (0.1,)}
    assert list(found) == ["drop", "incline", "friction"]


@cases
def test_a_fault_is_told_at_its_column(text, column, said):
    error = refused(InputError, "", read_vary, [text], NAMES)
    assert error.exit_code == 2
    assert f", column {column}: " in error.message
    assert said in error.message


def test_all_faults_are_told_at_once():
    given = ["drop=1", "friction=0..0.5:3", "friction=0.1", "mu=1"]
    error = refused(InputError, "", read_vary, given, NAMES)
    first, second, third = error.message.splitlines()
    assert "'drop=1'" in first
    assert "given twice" in second
    assert "'mu=1'" in third


def test_something_must_vary():
    refused(InputError, "nothing is varied", read_vary, ["friction=0.1"], NAMES)
