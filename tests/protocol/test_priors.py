"""Priors: keys of the protocol, listed by `rig check` and by their page, and used."""

from dataclasses import asdict

import pytest

from rig.analysis.components import priors
from rig.errors import InputError
from rig.protocol.describe import describe
from rig.protocol.keys import SECTIONS
from rig.protocol.protocol import Priors
from rig.protocol.reader import parse
from tests.analysis.drops import FENCE, UNIFORM, case
from tests.tables import cases

PRIORS = SECTIONS["priors"]


def scene(priors: str):
    return parse(f"{UNIFORM.text}\npriors: {priors}\n", "f")


def test_every_prior_has_a_key_and_what_is_left_out_is_as_by_default():
    assert [*PRIORS] == [*asdict(Priors())]
    found = scene("{hang: 1 mm, jitter: 5 us, drag: 0.2, impulses: 8 %, side: 0 mm}").priors
    assert found == Priors(hang=1e-3, jitter=5e-6, drag=0.2, impulses=0.08, side=0.0)
    assert UNIFORM.priors == Priors()


@cases
def test_what_is_no_prior_is_refused_at_its_place(text, said):
    with pytest.raises(InputError) as caught:
        scene(text)
    (problem,) = caught.value.problems
    assert problem.line == len(UNIFORM.text.splitlines()) + 2
    assert said in str(problem)


def test_rig_check_lists_them_all_and_marks_those_of_the_protocol():
    lines = describe(scene("{hang: 1 mm}")).splitlines()
    for name, key in PRIORS.items():
        (line,) = [one for one in lines if one.split()[:1] == [name]]
        assert line.endswith(key.meaning)
        assert ("(stated)" in line) == (name == "hang")


def test_rig_check_lists_none_that_nothing_depends_on():
    """A fence falls freely, and its cards are level."""
    listed = {line.split()[0] for line in describe(FENCE).splitlines() if line.startswith("  ")}
    assert listed & {*PRIORS} == {"edge_floor", "jitter", "hang", "drag"}


def test_an_adjustment_takes_what_the_protocol_states():
    wide = scene(
        "{hang: 3 mm, side: 5 mm, beam_offset: 10 mm, drag: 0.5, impulses: 50 %, departure: 2 mm}"
    )
    one = case(UNIFORM, incline=40.0)
    components = priors(wide)
    assert (components.hang, components.beam, components.impulse) == (3e-3, 10e-3, 0.5)
    narrow, loose = (
        case(protocol, run=one.run.number).analyze(None).quantities["separation_m"]
        for protocol in (UNIFORM, wide)
    )
    assert loose.u > 1.2 * narrow.u
