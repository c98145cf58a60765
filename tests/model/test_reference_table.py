"""The table of reference values in the project's physics notes, worked out with 60 digits."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from rig.model.predict import predict
from rig.protocol.reader import read

PROTOCOLS = Path(__file__).parents[2] / "protocols"
# incline (deg), α, Δz (m), V (m/s), t (s)
TABLE = [
    (0, "0.25", "0.17762380452368596", "8.3678802518552439", "0.48784955224134661"),
    (30, "0.19834747713266998", "0.14455777135466808", "7.5511640917900483", "0.49471049795616742"),
    (40, "0.15506060950816171", "0.11546810526538031", "6.9327596650855757", "0.50066864460340956"),
    (60, "0.068911961660286844", "0.053585554933341692", "5.8609487859073973",
     "0.51311334995443199"),
    (80, "0.01226400922538273", "0.0098142050953198042", "5.2579813110300101",
     "0.52173665052246976"),
]  # fmt: skip
PILE = "0.105", "0.080175519527158543", "6.2857634799081311", None
GRADED = None, "0.20034710240655192", "8.0478400772111967", None
ROWS = [
    *(("inclined-uniform", False, *row) for row in TABLE),
    *(("inclined-uniform", True, incline, *PILE) for incline in (0.0, 10.0, 29.999)),
    ("graded-chain", True, 40, *GRADED),
]


@pytest.mark.parametrize(("name", "pile", "incline", "alpha", "separation", "speed", "time"), ROWS)
def test_read_from_the_protocol(name, pile, incline, alpha, separation, speed, time):
    protocol = read(PROTOCOLS / f"{name}.yaml")
    surface = protocol.surface if pile else replace(protocol.surface, pile=None)
    chain = next(iter(protocol.chains.values())).chain
    found = predict(chain, surface, incline, protocol.drop, protocol.gravity)
    assert (found.in_domain, found.incline_deg) == (True, incline)
    values = found.alpha, found.separation_m, found.speed_m_s, found.fall_time_s
    for value, wanted in zip(values, (alpha, separation, speed, time), strict=True):
        if wanted is not None:
            assert value == pytest.approx(float(wanted), rel=1e-12, abs=0)
    stone = math.sqrt(2 * protocol.gravity.value * (protocol.drop.value + chain.heights[-1]))
    assert found.free_fall_speed_m_s == pytest.approx(stone, rel=1e-15)
    assert found.speed_m_s > stone
