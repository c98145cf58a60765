"""Predictions with an initial speed and in air, against the model and against many digits."""

import math
from itertools import accumulate

import pytest

from rig.bench.references import exact_coefficients, exact_fall
from rig.predictions import predictions
from rig.protocol.reader import read
from tests.cli.lab import PROTOCOLS
from tests.tables import protocol_text

TIGHT = 1e-13
MASSES = (0.0241, 0.0203, 0.0162, 0.0131, 0.0108, 0.0089, 0.0072, 0.0060)
GAPS = (0.051, 0.049, 0.048, 0.047, 0.046, 0.045, 0.044)
HEIGHTS = tuple(accumulate(GAPS, initial=0.0))
SCENE = protocol_text("six-rods")
EVEN = tuple(0.05 * k for k in range(6))
UNLIKE = "  B: {like: A, length: 300 mm, diameter: 12 mm}\nsurface"


@pytest.fixture
def predict(call, tmp_path):
    def ask(text):
        path = tmp_path / "p.yaml"
        path.write_text(text, "utf-8")
        done = call("predict", path, "--json")
        assert done.err == ""
        line, *others = done.json["predictions"]
        assert [one["impact_chain"] for one in others] == (["B"] if "impact_chain" in line else [])
        return line

    return ask


def close(line, wanted):
    found = line["separation_m"], line["speed_m_s"], line["fall_time_s"]
    assert found == pytest.approx([float(x) for x in wanted], rel=TIGHT, abs=0.0)


def rod_drag(coefficient, density, diameter, length, tilt_deg):
    """½ ρ C d L v² of the speed across the rod, and of that force the upright part."""
    return coefficient * density * diameter * length * math.cos(math.radians(tilt_deg)) ** 3 / 2


def fall_in_air(masses, heights, drag, incline, drop, initial_speed=0.0):
    """Both chains' fall, all rods held back alike; what falls yet shares the drag of its rods."""
    said = {"restitution": 0.5, "friction": 0.2, "inertia": 1 / 3, "incline": incline}
    count, known = len(masses), exact_coefficients(said)
    kappas = [drag * (count - k) / math.fsum(masses[k:]) for k in range(count)]
    given = ([known[name]] * count for name in ("alpha", "gamma"))
    return exact_fall(masses, heights, *given, drop, 9.81, initial_speed, kappas)


def test_the_ready_protocol_is_the_reference():
    protocol = PROTOCOLS / "weighed-chain.yaml"
    for one, incline in zip(predictions(read(protocol)), (40, 60), strict=True):
        line = one.json()
        drag = rod_drag(1.1, 1.2, 0.0127, 0.102, 12)
        close(line, fall_in_air(MASSES, HEIGHTS, drag, incline, 0.18, 1.5).values())
        assert line["model"] == "discrete, drag"
        assert line["separation_u_m"] > 0.0


def test_unlike_chains_differ_in_the_air_too(predict):
    """The free chain is longer and thicker: longer by 5 cm, and held back more."""
    line = predict(SCENE.replace("surface", UNLIKE) + "drag: {coefficient: 1.1}\n")
    mine, its = (rod_drag(1.1, 1.204, d, 0.09, 15) for d in (0.008, 0.012))
    end = fall_in_air((0.01,) * 6, EVEN, mine, 50, 0.15)
    time, kappa = float(end["time"]), its / 0.01
    way = math.log(math.cosh(time * math.sqrt(kappa * 9.81))) / kappa
    close(line, (0.15 + 0.3 - way, end["speed"], time))
    assert line["impact_chain"] == "A"
    thicker = UNLIKE.replace("length: 300 mm, ", "")
    line = predict(SCENE.replace("surface", thicker) + "drag: {coefficient: 1.1}\n")
    assert line["impact_chain"] == "A"
    assert "impact_chain" not in predict(SCENE.replace("surface", thicker))


def test_uncertain_speed_and_drag_widen_the_prediction(predict):
    for key, sure, more in (
        ("initial_speed: 2 m/s{}\n", 2.0, " ± 0.02 m/s"),
        ("drag: {{coefficient: 1.1{}}}\n", 1.1, " ± 0.2"),
        ("drag: {{terminal_speed: 12 m/s{}}}\n", 12.0, " ± 1 m/s"),
    ):
        exact = predict(SCENE + key.format(""))
        unsure = predict(SCENE + key.format(more))
        assert exact["speed_u_m_s"] == 0.0
        u = float(more.split()[1])
        low, high = (
            predict(SCENE + key.format("").replace(f"{sure:g}", repr(sure + d)))["speed_m_s"]
            for d in (-u, u)
        )
        # First order; c goes as the terminal speed to the power of −2.
        assert unsure["speed_u_m_s"] == pytest.approx(abs(high - low) / 2, rel=0.03)
