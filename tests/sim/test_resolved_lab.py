"""The resolved world as a lab: the same beams, edges and truth in front of it."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.errors import InputError
from rig.link.messages import pack_label
from rig.ports import truth_file
from rig.protocol import reader
from rig.runner import Operator, run_protocol
from sim import resolved_lab
from sim.dials import ResolvedDials
from sim.resolved import foresight
from sim.resolved.fall import fall
from sim.resolved_lab import ResolvedLab, at_level
from sim.scene import set_scene
from tests.tables import protocol_text

pytestmark = pytest.mark.usefixtures("loops_compiled")

GRAVITY = 9.81
SCENE = protocol_text("four-rods")


@pytest.fixture(scope="module")
def scene(tmp_path_factory) -> str:
    path = tmp_path_factory.mktemp("scene") / "four.yaml"
    path.write_text(SCENE)
    return str(path)


@pytest.fixture(scope="module")
def dropped(scene) -> tuple[ResolvedLab, list, list]:
    """Both drops of a session on a perfect rig: lab, truths, edges."""
    truths: list = []
    dials = replace(ResolvedDials.quiet(), skew_sd=2e-3, yaw_sd=1.0)
    lab = ResolvedLab(reader.read(scene), dials, 3, truths.append)
    edges = [lab.drop(pack_label(run, 1)) for run in (1, 2)]
    return lab, truths, edges


def test_truth_at_level_and_at_strike(dropped):
    _, truths, _ = dropped
    for truth in truths:
        top = 0.6 + 0.145

        def free(time_s, top=top):
            return top - 0.5 * GRAVITY * time_s**2

        assert truth.separation_m == pytest.approx(free(truth.fall_time_s), abs=1e-7)
        raw = free(truth.fall_time_s - truth.release_skew_s)
        assert truth.separation_raw_m == pytest.approx(raw, abs=1e-7)
        strike = free(truth.strike_time_s) - truth.contact_height_m
        assert truth.separation_strike_m == pytest.approx(strike, abs=1e-7)
        assert truth.speed_m_s > math.sqrt(2 * GRAVITY * 0.74) > 0
        assert truth.separation_m > 1e-3  # struck rods pulled it down
        # Noise of reading is 0.5 mm; the last frame comes up to 1/480 s early.
        assert truth.camera_separation_m == pytest.approx(truth.separation_m, abs=15e-3)
        assert truth.camera_speed_m_s == pytest.approx(truth.speed_m_s, abs=0.5)


def test_a_drop_comes_out_the_same_again_alone_and_made_ahead(dropped):
    lab, truths, edges = dropped
    assert lab.drop(pack_label(2, 1)) == edges[1]
    truths.pop()
    twin = ResolvedLab(lab.protocol, lab.dials, 3)
    labels = [pack_label(run, 1) for run in (2, 1)]
    twin.make_ahead(labels)
    twin.let_fall = None  # whatever falls now
    assert [twin.drop(label) for label in labels] == edges[::-1]


def test_a_session_runs_and_keeps_the_truth(scene, tmp_path):
    one = tmp_path / "one.yaml"
    text = Path(scene).read_text().replace("repeats: 2", "repeats: 1")
    one.write_text(text.replace("incline: 40 deg", "incline: 80 deg"))  # soon analysed
    path = tmp_path / "one.session"
    url = "sim://?dynamics=resolved&quiet=1&yaw_sd=1 deg"
    run_protocol(str(one), url, str(path), Operator(lambda _: None), 3)
    (truth,) = [json.loads(line) for line in truth_file(path).read_text().splitlines()]
    assert (truth["run"], truth["attempt"]) == (1, 1)


def test_a_fall_that_would_take_minutes_is_refused_and_a_long_one_told_of(
    scene, tmp_path, monkeypatch, caplog
):
    def asked(path: str) -> None:
        set_scene("sim", {"protocol": path, "dynamics": "resolved"})

    asked(scene)
    assert not caplog.records
    monkeypatch.setattr(foresight, "is_compiled", lambda: False)
    monkeypatch.setattr(resolved_lab, "is_compiled", lambda: False)
    asked(scene)
    (told,) = caplog.messages
    assert "numba is not installed" in told
    small = Path(scene).read_text()
    for was, now in (("145 mm", "20 mm"), ("12.7 mm", "0.1 mm"), ("102 mm", "2 mm")):
        small = small.replace(was, now)
    path = tmp_path / "threads.yaml"
    path.write_text(small)
    with pytest.raises(InputError, match="of 4 rods would take") as caught:
        asked(str(path))
    assert "numba" in caught.value.hint


def test_a_top_rod_that_never_lands_is_said(dropped):
    lab, _, _ = dropped
    struck = replace(fall(lab.chains(pack_label(1, 1))["impact"]), touched_s=np.full(4, np.inf))
    with pytest.raises(InputError, match="strikes nothing"):
        at_level(struck, GRAVITY)
