"""A board that comes back somewhere else, and another one that sits where it was."""

from __future__ import annotations

import os
import time
from contextlib import closing, contextmanager

import pytest
from serial.tools.list_ports_common import ListPortInfo

from rig.bench.stand import Stand
from rig.daemon.desk import Desk
from rig.daemon.hub import Hub
from rig.daemon.lease import Lease
from rig.daemon.worker import Worker
from rig.errors import DeviceError
from rig.session.store import Session


@pytest.fixture
def usb(monkeypatch):
    """Say which serial numbers are at these links, as /sys would say it."""
    monkeypatch.setattr("rig.daemon.station.BOOT_WAIT_S", 0.1)  # a terminal restarts no board
    links = {}

    def comports():
        found = []
        for link, serial_number in links.items():
            if link.exists():
                found.append(ListPortInfo(os.path.realpath(link)))
                found[-1].serial_number = serial_number
        return found

    monkeypatch.setattr("serial.tools.list_ports.comports", comports)
    return links


@contextmanager
def working(stand):
    """Have a worker at a board, with a session open, and a way to ask it."""
    lease = Lease(lambda: 0.0)
    lease.take("me", "a test")
    worker = Worker(str(stand.port), Hub(), lease)
    worker.start()

    def ask(work):
        return worker.submit(work, "me").result(timeout=10)

    try:
        ask(lambda desk: desk.open_session(str(stand.protocol), str(stand.session)))
        yield worker.hub, ask
    finally:
        worker.end()
        worker.join()


def awaited(reached):
    until = time.monotonic() + 10
    while not reached():
        assert time.monotonic() < until
        time.sleep(0.01)


def test_a_board_is_found_at_another_port_with_the_drop_it_holds(usb):
    with Stand(1) as stand:
        elsewhere = stand.folder / "elsewhere"
        usb |= {stand.port: "85430", elsewhere: "85430"}
        with working(stand) as (hub, ask):
            assert hub.get("port")["path"] == str(stand.port)
            ask(lambda desk: desk.fire(desk.arm(1, 1)))
            stand.hand(f"pull 0.3 {elsewhere}")
            awaited(lambda: hub.get("port")["path"] == os.path.realpath(elsewhere))
            drop = ask(lambda desk: desk.collect(1, 1))
        assert drop.faults == ()
        assert drop.edges
        with Session.open(stand.session, readonly=True) as session:
            ports = [(one["port"], one["usb_serial_number"]) for _, one in session.identities()]
        assert ports == [(str(stand.port), "85430"), (os.path.realpath(elsewhere), "85430")]


@pytest.mark.parametrize("numbers", [("85430", "999"), (None, None), ("85430", "85430")])
def test_another_board_where_it_was_is_not_taken_for_it(usb, numbers):
    with Stand(1, seed=1) as stand, Stand(1, seed=2) as other:
        usb |= {stand.port: numbers[0]}
        with working(stand) as (hub, ask):
            ask(lambda desk: desk.fire(desk.arm(1, 1)))
            awaited(lambda: hub.get("drop")["state"] == "recorded")
            stand.hand("pull 60")
            awaited(lambda: hub.get("link")["state"] == "down")
            usb[stand.port] = numbers[1]
            stand.port.symlink_to(other.port)
            awaited(lambda: "another board" in str(hub.get("error")))
            assert "give the same rig run command again" in hub.get("error")["hint"]
            with pytest.raises(DeviceError, match="no connection"):
                ask(lambda desk: desk.arm(2, 1))
            # Whoever means it says so by giving the command again.
            ask(lambda desk: desk.open_session(str(other.protocol), str(other.session)))
            assert hub.get("link")["state"] == "up"
        assert [seen["phase"] for seen in other.happened() if "phase" in seen] == []


def test_the_same_command_finds_it_too_when_nothing_is_where_it_was(usb):
    with Stand(1) as stand:
        elsewhere = stand.folder / "elsewhere"
        usb |= {stand.port: "85430", elsewhere: "85430"}
        with closing(Desk(str(stand.port))) as desk:
            desk.open_session(str(stand.protocol), str(stand.session))
        stand.hand(f"pull 0 {elsewhere}")
        awaited(elsewhere.exists)
        with closing(Desk(str(stand.port))) as desk:
            desk.open_session(str(stand.protocol), str(stand.session))
            assert desk.hub.get("port")["path"] == os.path.realpath(elsewhere)
        usb[elsewhere] = "999"
        with closing(Desk(str(stand.port))) as desk, pytest.raises(DeviceError, match="no such"):
            desk.open_session(str(stand.protocol), str(stand.session))
