"""A daemon that nobody asked for by name ends when nobody needs it, and never with a drop."""

import time

import pytest

from bench.process_fixture import ProcessFixture
from rig.errors import RigError
from rig.link.messages import Phase
from rig.session.store import Session
from tests.cli.lab import log_of
from tests.daemon.at_work import ended
from tests.waiting import PATIENCE_S, until

IDLE_S = 0.4
ALONE = f"no client for {IDLE_S:g} s"


@pytest.fixture
def processes():
    """Have a board and a daemon that ends when it is left alone."""
    with ProcessFixture(runs=2, seed=3) as made:
        made.start_daemon("--idle-timeout", str(IDLE_S))
        yield made


@pytest.fixture
def client(processes):
    """Connect clients; on a busy machine a daemon may have ended before one was ready to."""
    made = []

    def connect(name):
        while True:
            try:
                made.append(processes.client(name))
            except RigError:
                assert processes.daemon.wait(PATIENCE_S) == 0
                processes.kill(processes.daemon)
                processes.start_daemon("--idle-timeout", str(IDLE_S))
            else:
                return made[-1]

    yield connect
    for one in made:
        one.close()


def test_it_stays_while_a_client_is_there_and_disarms_before_it_ends(processes, driver):
    time.sleep(3 * IDLE_S)
    assert driver.call("renew") == {"disk_s": 0.0}
    driver.arm(1, 1)
    driver.close()
    assert ALONE in ended(processes)
    assert not processes.socket.exists()
    processes.await_phase(Phase.IDLE)
    assert log_of(processes.session) == {1: [(1, "armed"), (1, "interrupted")]}


def test_a_drop_that_only_the_board_has_is_waited_for(processes, driver):
    driver.fire(driver.arm(1, 1))
    processes.hand("pull 2")
    driver.close()
    ended(processes)
    assert log_of(processes.session) == {1: [(1, "armed"), (1, "fired"), (1, "recorded")]}


def test_it_stays_until_the_disk_has_taken_everything(processes, driver):
    processes.fill_disk()
    until(lambda: driver.call("subscribe")["state"]["phase"] == "trouble")  # until then all is kept
    driver.close()
    time.sleep(4 * IDLE_S)
    assert processes.daemon.poll() is None
    processes.free_disk()
    assert "\ntrouble: " in ended(processes)
    with Session.open(processes.session, readonly=True) as session:
        assert list(session.pings())
