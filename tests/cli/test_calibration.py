"""Which clock a result stands on: said by every run, the same whenever it is computed."""

import hashlib
import re
from dataclasses import replace
from itertools import pairwise

import pytest

from rig.link import messages as wire
from rig.results.whole import calibration
from rig.session.store import Session
from tests.cli.lab import frames_of
from tests.cli.test_replay import tamper

PING, REFERENCE, STATUS = (wire.CODES[kind] for kind in (wire.Ping, wire.Reference, wire.Status))
ARM, FIRE = wire.CODES[wire.Arm], wire.CODES[wire.Fire]
CERTIFICATE, DISARMED = wire.CODES[wire.DropCertificate2], wire.CODES[wire.Disarmed]


@pytest.fixture
def measure(call, tmp_path, fence):
    """Run a fence on a simulated port and return its session and JSON."""

    def measure(dials="", name="s", protocol=fence):
        session = tmp_path / name
        done = call("run", protocol, "--port", f"sim://{dials}", "--session", session, "--json")
        return session, done.json

    return measure


def test_every_result_says_its_calibration_and_says_it_again(measure, call):
    session, found = measure()
    said = found["calibration"]
    assert said["source"] == "pings"
    assert abs(said["rate_ppm"] + 1300.0) < 4.0 * said["u_ppm"] < 100.0
    assert said["pings"] > 8
    assert (said["epochs"], said["host_breaks"]) == (1, 0)
    assert said["gravity"]["agrees"]
    for run in found["runs"]:
        assert run["calibration"]["source"] == "pings"
        assert abs(run["calibration"]["rate_ppm"] + 1300.0) < 4.0 * run["calibration"]["u_ppm"]
    for _ in range(2):
        assert call("analyze", session, "--json").json == found
    assert call("replay", session).out.splitlines()[-1] == "identical"
    line = call("analyze", session).out.splitlines()[-1]
    assert re.match(r"Board clock: 1\d{3} ppm slow, corrected \(± \S+ ppm\)\.$", line)


def test_a_drifting_clock_gives_each_run_its_own_rate(measure, tmp_path, fence):
    text = fence.read_text("utf-8").replace("settle: 1 s", "settle: 60 s")
    protocol = tmp_path / "long.yaml"
    protocol.write_text(text.replace("repeats: 2", "repeats: 6"), "utf-8")
    session, found = measure("?drift=600ppm&seed=2", "d", protocol)
    rates = [run["calibration"]["rate_ppm"] for run in found["runs"]]
    assert len(rates) == 6
    for one, two in pairwise(rates):
        assert two - one == pytest.approx(600.0 * 61.5 / 3600.0, abs=4.0)
    assert found["calibration"]["wander_ppm_sqrt_h"] > 10.0
    assert any("wanders" in note for note in found["calibration"]["notes"])
    with Session.open(session, readonly=True) as opened:
        clock = calibration(opened)
        *_, last = drops = list(opened.drops())
    for run, drop in zip(found["runs"], drops, strict=True):
        true = -1300.0 + 600.0 * clock.fired.when(drop, clock.device.hz) / 3600.0
        used = run["calibration"]
        assert abs(used["rate_ppm"] - true) < 4.0 * used["u_ppm"] < 16.0
    lost = clock.describe(replace(last, attempt=7))  # nobody logged when
    assert lost["rate_ppm"] == pytest.approx(found["calibration"]["rate_ppm"])
    assert lost["u_ppm"] > 10.0


def test_gravity_that_is_not_the_places_is_said(measure, call, fence):
    text = fence.read_text("utf-8")
    assert "gravity: 9.81" in text
    session, _ = measure()
    wrong = session.with_name("wrong")
    wrong.write_bytes(session.read_bytes())
    text = text.replace("gravity: 9.81", "gravity: 9.91")
    tamper(wrong, "UPDATE protocol SET text = ?", text)
    assert "its protocol was altered" in call("analyze", wrong, code=2).err
    digest = hashlib.sha256(text.encode()).hexdigest()
    tamper(wrong, "UPDATE meta SET value = ? WHERE key = 'protocol_sha256'", digest)
    found = call("analyze", wrong, "--json").json
    assert not found["calibration"]["gravity"]["agrees"]
    assert found["calibration"]["gravity"]["normalized_error"] < -1.0
    assert "free fall gives g = 9.8" in call("analyze", wrong).out.splitlines()[-1]


def test_nothing_asks_for_the_time_from_arming_to_the_certificate(finished):
    """Only what keeps the device armed, and what fires: by the bytes themselves."""
    armed, during, idle = False, [], []
    for direction, frame in frames_of(finished.session):
        if frame.type == ARM:
            armed = True
        if direction == "tx":
            (during if armed else idle).append(frame.type)
        if frame.type in {CERTIFICATE, DISARMED}:
            armed = False
    assert during.count(FIRE) == 4
    assert set(during) <= {ARM, FIRE, STATUS}
    assert {PING, REFERENCE} <= set(idle)


def test_a_long_session_stands_on_its_reference_and_on_what_the_protocol_says_of_it(
    measure, call, tmp_path, fence
):
    text = fence.read_text("utf-8").replace("settle: 1 s", "settle: 30 s")
    for name, stated in (("gps", ""), ("poor", "reference: 3 ppm\n")):
        protocol = tmp_path / f"{name}.yaml"
        protocol.write_text(text + stated, "utf-8")
        session, found = measure("?reference=0.05ppm", name, protocol)
        said = found["calibration"]
        with Session.open(session, readonly=True) as opened:
            pulses = len(opened.pulses())
        assert said["source"] == ("reference" if name == "gps" else "pings"), "the better known"
        assert said["pulses"] == pulses >= 5
        assert all(run["calibration"]["source"] == said["source"] for run in found["runs"])
        if name == "gps":
            assert said["rate_ppm"] == pytest.approx(-1300.05, abs=0.02)
            assert said["u_ppm"] == pytest.approx(0.1, rel=0.1)
            assert said["clock_u_ppm"] == pytest.approx(0.1)
        assert f"reference pulses: {pulses} identical" in call("replay", session).out
        changed = session.with_name("changed")
        changed.write_bytes(session.read_bytes())
        tamper(changed, "UPDATE reference SET tick = tick + 9 WHERE id = 1")
        assert "reference pulses" in call("replay", changed, code=1).out.splitlines()[-1]
