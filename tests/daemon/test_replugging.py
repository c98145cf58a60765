"""A board that comes back elsewhere or is in another room, and another one where it was."""

import os
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from bench.invariants import broken
from bench.process_fixture import ProcessFixture
from rig.errors import DeviceError
from rig.link.messages import Phase
from rig.link.port import BAUDRATE
from rig.recorder.board_locator import BoardLocator
from rig.recorder.controller import Controller
from rig.recorder.published import PublishedState
from rig.session.store import Session
from tests.daemon.at_work import let_fall, working
from tests.daemon.far_port import FarPort
from tests.flash.pty_board import info
from tests.link.talk import IDENTITY
from tests.refusals import refused
from tests.tables import cases
from tests.waiting import until


@pytest.fixture
def usb(monkeypatch):
    """Say which serial numbers are at these links, as /sys would say it."""
    monkeypatch.setattr("rig.recorder.recorder.BOOT_WAIT_S", 0.1)  # a terminal restarts no board
    links = {}

    def comports():
        there = {link: number for link, number in links.items() if link.exists()}
        return [info(os.path.realpath(link), serial_number=there[link]) for link in there]

    monkeypatch.setattr("serial.tools.list_ports.comports", comports)
    return links


def test_a_board_is_found_at_another_port_with_the_drop_it_holds(usb):
    with ProcessFixture(1) as processes:
        elsewhere = processes.folder / "elsewhere"
        usb |= {processes.port: "85430", elsewhere: "85430"}
        with working(processes) as (worker, ask):
            assert worker.published.get("port")["path"] == str(processes.port)
            attempt = let_fall(ask)
            processes.hand(f"pull 0.3 {elsewhere}")
            until(lambda: worker.published.get("port")["path"] == os.path.realpath(elsewhere))
            drop = ask(lambda controller: controller.collect(1, attempt))
        assert drop.faults == ()
        assert drop.edges
        with Session.open(processes.session, readonly=True) as session:
            ports = [(one["port"], one["usb_serial_number"]) for _, one in session.identities()]
        assert ports == [(str(processes.port), "85430"), (os.path.realpath(elsewhere), "85430")]


@cases
def test_a_board_is_taken_for_itself_wherever_it_is(usb, tmp_path, course):
    locator = BoardLocator(str(tmp_path / "port"))

    def there(numbers):
        usb.clear()
        usb.update({tmp_path / name: number for name, number in numbers.items()})
        for link in tmp_path.iterdir():
            link.unlink()
        for link in usb:
            link.touch()

    deeds = {
        "there": there,
        "bound": lambda bound: setattr(locator, "bound", bound),
        "seek": locator.seek,
        "look": lambda _: Path(locator.look()).name,
        "meet": lambda number: locator.meet(replace(IDENTITY, unique_id=bytes([number]))),
    }
    for deed, value, came in course:
        try:
            told = deeds[deed](value)
        except DeviceError as error:
            told = error.message.replace(f"{tmp_path}/", "")
        assert told == came, (deed, value)


def test_the_same_command_finds_it_too_when_nothing_is_where_it_was(usb):
    with ProcessFixture(1) as processes:
        elsewhere = processes.folder / "elsewhere"
        usb |= {processes.port: "85430", elsewhere: "85430"}
        with closing(Controller(str(processes.port), PublishedState())) as controller:
            controller.open_session(processes.protocol, processes.session)
        processes.hand(f"pull 0 {elsewhere}")
        until(elsewhere.exists)
        with closing(Controller(str(processes.port), PublishedState())) as controller:
            controller.open_session(processes.protocol, processes.session)
            assert controller.published.get("port")["path"] == os.path.realpath(elsewhere)
        usb[elsewhere] = "999"
        with closing(Controller(str(processes.port), PublishedState())) as controller:
            names = str(processes.protocol), str(processes.session)
            refused(DeviceError, "no such", controller.open_session, *names)


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
