"""The table of reference values in the project's physics notes, worked out with 60 digits."""

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
PILE_ALPHA, PILE_SEPARATION, PILE_SPEED = 0.105, 0.080175519527158543, 6.2857634799081311
GRADED_SEPARATION, GRADED_SPEED = 0.20034710240655192, 8.0478400772111967


def exactly(value):
    return pytest.approx(float(value), rel=1e-12, abs=0)


def scene(name):
    protocol = read(PROTOCOLS / f"{name}.yaml")
    return protocol, next(iter(protocol.chains.values())).chain


@pytest.mark.parametrize(("incline", "alpha", "separation", "speed", "time"), TABLE)
def test_read_from_the_protocol(incline, alpha, separation, speed, time):
    protocol, chain = scene("inclined-uniform")
    bare = replace(protocol.surface, pile=None)
    found = predict(chain, bare, incline, protocol.drop, protocol.gravity)
    assert found.in_domain
    assert found.alpha == exactly(alpha)
    assert found.separation_m == exactly(separation)
    assert found.speed_m_s == exactly(speed)
    assert found.fall_time_s == exactly(time)


@pytest.mark.parametrize("incline", [0.0, 10.0, 20.0, 29.999])
def test_below_30_degrees_the_protocol_means_the_pile(incline):
    protocol, chain = scene("inclined-uniform")
    found = predict(chain, protocol.surface, incline, protocol.drop, protocol.gravity)
    assert found.alpha == exactly(PILE_ALPHA)
    assert found.separation_m == exactly(PILE_SEPARATION)
    assert found.speed_m_s == exactly(PILE_SPEED)


def test_graded_chain_read_from_the_protocol():
    protocol, chain = scene("graded-chain")
    found = predict(chain, protocol.surface, 40, protocol.drop, protocol.gravity)
    assert found.in_domain
    assert found.separation_m == exactly(GRADED_SEPARATION)
    assert found.speed_m_s == exactly(GRADED_SPEED)
