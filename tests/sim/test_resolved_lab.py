"""The resolved world as a lab: the same beams, edges and truth in front of it."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.errors import InputError
from rig.films import Film, read_films
from rig.link.messages import pack_label
from rig.ports import truth_file
from rig.protocol import reader
from rig.runner import Operator, run_protocol
from sim import fall_cache, resolved_lab
from sim.dials import Dials, read_dials
from sim.film import film
from sim.resolved import foresight
from sim.resolved.fall import fall
from sim.resolved_dials import ResolvedDials, read_resolved_dials
from sim.resolved_lab import ResolvedLab, at_level
from sim.scene import choose_world, set_scene

pytestmark = pytest.mark.usefixtures("loops_compiled")

GRAVITY = 9.81
SCENE = """
protocol: 1
title: Four rods
chains:
  A: {rods: 4, length: 145 mm, diameter: 12.7 mm, rod_length: 102 mm, tilt: 12 deg}
  B: {like: A}
surface: {restitution: 0.5, friction: 0.2}
drop: 600 mm
gravity: 9.81 m/s^2
gates:
  impact: [{channel: 0, height: 25 mm}, {channel: 1, height: 60 mm}, {channel: 2, height: 400 mm}]
  free: [{channel: 8, height: 25 mm}, {channel: 9, height: 60 mm}, {channel: 10, height: 400 mm}]
plan: {incline: 40 deg, repeats: 2, order: ABBA, settle: 0 s}
accept: {release_skew: 20 ms}
"""


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory):
    """Falls made here are kept here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def scene(tmp_path_factory) -> str:
    path = tmp_path_factory.mktemp("scene") / "four.yaml"
    path.write_text(SCENE)
    return str(path)


@pytest.fixture(scope="module")
def dropped(scene) -> tuple[ResolvedLab, list, list]:
    """Both drops of a session on a perfect rig: lab, truths, edges."""
    truths: list = []
    lab = ResolvedLab(
        reader.read(scene), replace(Dials.quiet(), skew_sd=2e-3), 3, truths.append,
        world=read_resolved_dials({"quiet": "1", "yaw_sd": "1 deg"}),
    )  # fmt: skip
    edges = [lab.drop(pack_label(run, 1)) for run in (1, 2)]
    return lab, truths, edges


def test_free_chain_darkens_beams_as_free_fall_does(dropped):
    lab, truths, _ = dropped
    half = 12.7e-3 / 2 / math.cos(math.radians(12))
    for truth in truths:
        let_go = Dials().delay + truth.release_skew_s
        seen = {(ch, dark, rod): t for t, ch, dark, rod in truth.edges if ch >= 8}
        for gate in lab.protocol.gates.on("free"):
            for rod in range(4):
                middle = 0.6 + rod * 0.145 / 3 - gate.height
                for dark, way in ((True, middle - half), (False, middle + half)):
                    wanted = let_go + math.sqrt(2 * way / GRAVITY)
                    assert seen[gate.channel, dark, rod] == pytest.approx(wanted, abs=0.2e-6)


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
        assert all(impulse > 0.0 for impulse in truth.impulses[:-1])
        assert truth.lost["board"] > 0.0
        assert 0.0 <= truth.slack <= 1.0


def test_a_drop_comes_out_the_same_alone_again_and_from_the_disk(dropped, monkeypatch, tmp_path):
    lab, truths, edges = dropped
    assert lab.drop(pack_label(2, 1)) == edges[1]
    truths.pop()

    def again() -> list:
        twin = ResolvedLab(lab.protocol, lab.dials, 3, world=lab.world)
        return twin.drop(pack_label(2, 1))

    assert again() == edges[1]  # from the disk
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert again() == edges[1]


def test_arming_a_drop_has_the_next_ones_made(dropped, monkeypatch, tmp_path):
    lab, _, edges = dropped
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    made: list[int] = []

    def make(self, label):
        made.append(label)
        return self._hidden(label)

    monkeypatch.setattr(ResolvedLab, "_hidden", ResolvedLab._make, raising=False)
    monkeypatch.setattr(ResolvedLab, "_make", make)
    twin = ResolvedLab(lab.protocol, lab.dials, 3, world=lab.world)
    labels = [pack_label(run, 1) for run in (1, 2)]
    twin.rest(labels[0])
    twin.rest(labels[0])  # armed once more
    assert [twin.drop(label) for label in labels] == edges
    assert sorted(made) == labels


@pytest.mark.parametrize("hurt", [lambda t: t[:-1], lambda t: t.replace("1", "2"), lambda _: "[]"])
def test_a_fall_that_was_damaged_on_the_disk_is_made_anew(hurt, monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    fall_cache.save("x", {"a": 1})
    assert fall_cache.load("x") == {"a": 1}
    (path,) = fall_cache.folder().iterdir()
    path.write_text(hurt(path.read_text()))
    assert fall_cache.load("x") is None


def test_a_session_runs_and_keeps_the_truth(scene, tmp_path):
    one = tmp_path / "one.yaml"
    text = Path(scene).read_text().replace("repeats: 2", "repeats: 1")
    one.write_text(text.replace("incline: 40 deg", "incline: 80 deg"))  # soon analysed
    path = tmp_path / "one.session"
    url = "sim://?dynamics=resolved&quiet=1&yaw_sd=1 deg"
    run_protocol(str(one), url, str(path), Operator(lambda _: None), 3)
    (truth,) = [json.loads(line) for line in truth_file(path).read_text().splitlines()]
    with truth_file(path).open("a") as cut:
        cut.write('{"run": 2, "attempt"')
    ((label, shown),) = read_films(path).items()
    assert label == (truth["run"], truth["attempt"]) == (1, 1)
    assert shown.touched_s == pytest.approx(truth["touched_s"], abs=1e-5)
    assert shown.times_s[-1] > truth["strike_time_s"]


@pytest.mark.parametrize(
    ("setting", "text", "says"),
    [
        ("dynamics", "real", "model or resolved"),
        ("string_restitution", "0.05", "0.1 to 1"),
        ("board_time", "2 mm", "a time"),
        ("rods_touch", "0.5", "neither 0 nor 1"),
        ("spin_sd", "3", "rad/s"),
        ("swing_sd", "1e9 m/s", "0 to 10 m/s"),
        ("tilt_sd", "30 deg", "in each other as it hangs"),
        ("drag", "1000", "more than 5 s"),
        ("hang_sd", "9 m", "as it hangs"),
        ("restitution", "-0.37", "restitution"),
    ],
)
def test_bad_settings_are_refused(scene, setting, text, says):
    with pytest.raises(InputError) as caught:
        set_scene("sim", {"protocol": scene, "dynamics": "resolved"} | {setting: text})
    assert says in f"{caught.value} {caught.value.hint}"


def test_dials_of_the_resolved_world_are_unknown_to_the_model():
    with pytest.raises(InputError, match="string_restitution") as caught:
        read_dials(choose_world({"string_restitution": "0.5"})[1])
    assert caught.value.hint == "add dynamics=resolved"


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


def test_air_takes_from_a_chain_what_the_dial_says(scene):
    lab = ResolvedLab(
        reader.read(scene), replace(Dials.quiet(), drag=0.05), 3, world=ResolvedDials()
    )
    chain = lab.chains(pack_label(1, 1))["impact"]
    mean = (chain.drag * chain.rods.masses).sum() / chain.rods.masses.sum()
    assert np.isclose(mean, 0.05, rtol=1e-12)


def test_air_takes_less_from_a_chain_of_thicker_rods(scene):
    protocol = reader.read(scene)
    thin = next(iter(protocol.chains.values()))
    thick = replace(thin, name="B", diameters=tuple(2.0 * d for d in thin.diameters))
    both = replace(protocol, chains={thin.name: thin, thick.name: thick})
    lab = ResolvedLab(both, replace(Dials.quiet(), drag=0.05), 3, world=ResolvedDials())
    chains = lab.chains(pack_label(1, 1)).values()
    assert sorted({round(float(chain.drag[0]), 12) for chain in chains}) == [0.025, 0.05]


def test_a_film_shows_rods_whole_and_above_the_board(dropped):
    lab, _, _ = dropped
    chain = lab.chains(pack_label(1, 1))["impact"]
    found = fall(chain)
    shown = Film(**film(chain, found))
    left, right = np.array(shown.left), np.array(shown.right)
    assert left.shape == right.shape == (len(shown.times_s), 4, 3)
    assert np.linalg.norm(right - left, axis=-1) == pytest.approx(0.102, abs=2e-4)
    places = np.array([shown.middles(n) for n in range(len(left))])
    board = shown.board_m - places[..., 1] * math.tan(math.radians(shown.incline_deg))
    assert (places[..., 2] > board).all()
    # 18.8 mm: L/2 sin 12° and r/cos 40°, nearly
    assert shown.board_m == pytest.approx(-0.0188, abs=0.2e-3)
    # What falls by formula and what falls by steps make one fall, from the release on.
    for rod in range(4):
        heights = np.interp(shown.times_s, found.times, found.heights[:, rod])
        assert places[:, rod, 2] == pytest.approx(heights, abs=0.1e-3)
    assert shown.times_s[0] < 1e-3
    assert shown.touched_s == pytest.approx(found.touched_s, abs=1e-5)
    before, after = (shown.nearest(found.touched_s[0] + late) for late in (-0.01, 0.01))
    left, right = (np.array([ends[before], ends[after]]) for ends in (shown.left, shown.right))
    rods = right - left
    tilts_deg = np.degrees(np.arcsin(rods[:, :, 2] / np.linalg.norm(rods, axis=2)))
    assert tilts_deg[0, :2] == pytest.approx([12.0, -12.0], abs=0.2)
    assert abs(tilts_deg[1, 0] - 12.0) > 5.0  # its end was thrown up
    assert shown.slack(before) == ([False] * 3, [False] * 3)
    assert any(shown.slack(after)[0] + shown.slack(after)[1])


def test_a_free_chain_swings_too(scene):
    still, swinging = (
        ResolvedLab(
            reader.read(scene), Dials.quiet(), 3,
            world=read_resolved_dials({"quiet": "1", "swing_sd": f"{speed} m/s"}),
        ).chains(pack_label(1, 1))
        for speed in (0.0, 0.1)
    )  # fmt: skip
    for side in ("impact", "free"):
        assert not still[side].swing.any()
        speeds = np.abs(swinging[side].swing)
        assert speeds[0] > speeds[1] > speeds[2] > speeds[3] == 0.0  # it hangs by its top
