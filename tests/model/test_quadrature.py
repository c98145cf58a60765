"""Rules of integration are shared by all that integrate."""

import pytest

from rig.model.quadrature import gauss


def test_rules_are_shared_and_cannot_be_spoilt():
    assert gauss(7) is gauss(7)
    with pytest.raises(ValueError, match="read-only"):
        gauss(7).weights[0] = 0.0
