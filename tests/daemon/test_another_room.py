"""A board in another room, through a program there that passes its port on."""

from __future__ import annotations

import pytest

from bench.invariants import broken
from bench.process_fixture import ProcessFixture
from rig.link.messages import Phase
from rig.link.port import BAUDRATE
from tests.daemon.far_port import FarPort


@pytest.mark.parametrize(
    ("scheme", "lost", "said"),
    [
        ("rfc2217", FarPort.hang_up, "connection lost"),
        pytest.param("socket", FarPort.fall_silent, "did not answer", marks=pytest.mark.slow),
    ],
)
def test_a_session_survives_a_connection_that_is_lost_while_chains_fall(scheme, lost, said):
    with ProcessFixture(1) as processes, FarPort(processes.port, scheme) as far:
        processes.port = far.url
        processes.start_daemon()
        processes.start_runner()
        processes.await_phase(Phase.RECORDING)
        lost(far)
        assert processes.waited() == 4
        assert said in processes.told
        assert processes.run() == 0, processes.told
        assert broken(processes.session, processes.happened(), 1) == []
        if scheme == "rfc2217":
            assert far.baudrates[0] == BAUDRATE, "as it was asked for over there"
