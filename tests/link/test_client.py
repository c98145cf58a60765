"""What client and port do when a device, a line or an address misbehaves."""

import socket
import sys
from dataclasses import replace
from itertools import groupby

import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st

from rig.clock.host import SystemClock
from rig.errors import DeviceError, DeviceTimeoutError
from rig.link import messages as wire
from rig.link.client import Device
from rig.link.exchange import STRANGE_BYTES
from rig.link.frames import Decoder, Frame, encode
from rig.link.port import check_url, open_port, port_clock
from rig.link.refusals import DeviceRefusedError
from rig.link.transcript import Incoming, Restart, Transcript
from rig.reasons import make_reason
from rig.records import ClockSample, Drop
from sim.clock import VirtualClock
from tests.daemon.far_port import FarPort
from tests.flash.pty_board import PtyBoard
from tests.link.bench import LABEL, ScriptedLab, falling_rods
from tests.link.strategies import MESSAGES
from tests.link.talk import IDENTITY, arm, connected, framed
from tests.refusals import refused
from tests.tables import cases
from tests.waiting import until

SMALL = st.integers(0, 3)
ALWAYS = lambda: True  # noqa: E731


class FakePort:
    """Answers each request by a table from its type to messages; `None` is a broken cable."""

    def __init__(self, clock: VirtualClock, answers: dict) -> None:
        self.clock, self.answers = clock, answers
        self.decoder, self.out = Decoder(), b""
        self.written: list[bytes] = []
        self.frames: list[Frame] = []  # that were written

    @property
    def in_waiting(self) -> int:
        return len(self.out)

    def read(self, size: int = 1) -> bytes:
        self.clock.sleep(0.001 if self.out else 0.02)
        data, self.out = self.out[:size], self.out[size:]
        return data

    def write(self, data: bytes) -> int:
        self.written.append(data)
        for frame in self.decoder.feed(data):
            self.frames.append(frame)
            request = wire.unpack(frame.type, frame.payload)
            answer = self.answers.get(type(request), [])
            if answer is None:
                raise serial.SerialException("device reports readiness to read but is gone")
            for message in answer:
                self.out += framed(message, ack=frame.seq)
        return len(data)


@pytest.fixture
def clock() -> VirtualClock:
    return VirtualClock()


def spoken(data: bytes) -> str:
    """Name what a client writes: a request, or what is no frame."""
    (name,) = [wire.TABLE[frame.type].__name__ for frame in Decoder().feed(data)] or [data.hex()]
    return name


@cases
def test_each_talk_takes_its_course(clock, ask, answers, said, told, counted):
    """What is written how often, when first and when last, ms; what comes of it, and the counts."""
    port, written = FakePort(clock, {}), []
    for kind, messages in answers.items():
        port.answers[getattr(wire, kind)] = [getattr(wire, name)(*of) for name, *of in messages]
    device = Device(port, clock, lambda *chunk: written.append(chunk))
    method, *values = ask
    try:
        came = getattr(device, method)(*(ALWAYS if one == "stop" else one for one in values))
        came = [fault.code for fault in came.faults] if isinstance(came, Drop) else str(came)
    except DeviceError as error:
        came = error.message
    talk = [(spoken(data), ns // 10**6) for way, ns, data in written if way == "tx"]
    groups = [(name, [ms for _, ms in of]) for name, of in groupby(talk, lambda one: one[0])]
    assert [[name, len(ms), ms[0], ms[-1]] for name, ms in groups] == said
    assert (came, [*device.statistics().values()]) == (told, counted)


class Captive(FakePort):
    """A board whose boot loader goes on 5 s after the last byte that it heard."""

    freed_ns = 0

    def read(self, size=1):
        if self.freed_ns and self.clock.now_ns() >= self.freed_ns:
            self.freed_ns = 0
            self.answers = {wire.Identify: [IDENTITY]}
            self.out = b"\0" + framed(wire.Boot(0))
        return super().read(size)

    def write(self, data):
        if not self.answers:
            self.freed_ns = self.clock.now_ns() + 5 * 10**9
        return super().write(data)


def test_a_boot_loader_is_left_in_peace_until_it_lets_go(clock):
    assert Device(Captive(clock, {}), clock).connect() == IDENTITY


@pytest.mark.parametrize("noise", [b"\x55" * 4096, bytes(range(256)) * 16, b"\0" * 4096])
def test_a_flood_from_who_knows_whom_is_ended_after_a_mebibyte(clock, noise):
    port, kept = FakePort(clock, {}), []
    port.read = lambda size: clock.sleep(1e-4) or noise[:size]
    port.out = noise  # what waits
    one = Device(port, clock, tap=lambda _way, _ns, data: kept.append(len(data)))
    refused(DeviceError, r"1\.\d MB of bytes that are no frames", one.connect)
    assert sum(kept) <= STRANGE_BYTES + 2 * len(noise)


def test_seq_wraps_around_zero(clock):
    port = FakePort(clock, {wire.Ping: [wire.Pong(1)]})
    one = Device(port, clock)
    for _ in range(300):
        one.ping()
    assert [frame.seq for frame in port.frames] == [n % 254 + 1 for n in range(300)]


@pytest.mark.parametrize("ask", [Device.status, Device.receive, Device.statistics])
def test_a_broken_cable_is_a_lost_connection(clock, monkeypatch, ask):
    def closed(_port):
        raise serial.PortNotOpenError

    port = FakePort(clock, {wire.Status: None})
    if ask is not Device.status:
        monkeypatch.setattr(FakePort, "in_waiting", property(closed))
    error = refused(DeviceError, "connection lost", ask, Device(port, clock))
    assert not isinstance(error, DeviceTimeoutError)


def test_the_tap_comes_before_everything(clock):
    seen = []
    port = FakePort(clock, {wire.Ping: [wire.Pong(5)]})

    def tap(direction, host_ns, data):
        # What is written is tapped before the port has it.
        assert direction == "rx" or data not in port.written
        seen.append((direction, host_ns, data))

    ping = Device(port, clock, tap).ping()
    assert ping == ClockSample(seen[0][1], seen[-1][1], 5)
    assert b"".join(data for direction, _, data in seen if direction == "tx") == port.written[0]


def certificate(label: int, events: int, crc32: int = 0) -> wire.DropCertificate:
    return wire.DropCertificate(label, 100, 0xFFFF, 0, events, crc32, 0, 0, 0, 0, 0)


def events_frame(first, *events) -> wire.EventsFrame:
    return wire.EventsFrame(1, first, wire.pack_events(events))


class Liar(FakePort):
    """Says how many events it holds, and gives others."""

    def __init__(self, clock, held, *answers):
        super().__init__(clock, {wire.Identify: [IDENTITY]})
        self.held, self.events = held, answers

    def write(self, data):
        (frame,) = Decoder().feed(data)
        count = wire.unpack(frame.type, frame.payload).count
        self.answers[wire.Read] = self.events if count else [certificate(1, self.held, 77)]
        return super().write(data)


def test_events_that_do_not_match_their_certificate_are_read_once_more(clock):
    """As far as the device keeps them."""
    port = Liar(clock, 3, events_frame(0, (150, 1), (160, 0), (170, 1)))
    device = Device(port, clock)
    device.transcript.feed("rx", 0, framed(replace(IDENTITY, capacity=2)))
    drop = device.fetch(1)
    asked = [wire.unpack(frame.type, frame.payload) for frame in port.frames]
    assert [(read.first, read.count) for read in asked] == [(0, 0), (0, 3), (1, 2)]
    assert (len(drop.edges), drop.faults) == (3, (make_reason("crc_mismatch"),))


@pytest.mark.parametrize(
    ("held", "answers", "error", "said", "asked"),
    [
        (5, [events_frame(0)], DeviceError, "did not send the events", [0, 5]),
        (5, [wire.Refused(wire.RefusalReason.NOT_KEPT, 0)], DeviceRefusedError, "", [0, 5]),
        (50, [], DeviceTimeoutError, "did not answer", [0, 40, 40, 20, 20, 10, 10, 5, 5, 4, 4]),
    ],
)
def test_who_does_not_give_what_it_holds_is_not_asked_for_ever(
    clock, held, answers, error, said, asked
):
    port = Liar(clock, held, *answers)
    refused(error, said, Device(port, clock, tries=4).fetch, 1)
    assert [wire.unpack(frame.type, frame.payload).count for frame in port.frames] == asked


@pytest.mark.parametrize("reason", wire.DisarmReason)
def test_a_device_that_disarmed_itself_has_a_reason(clock, reason):
    port = FakePort(
        clock,
        {
            wire.Arm: [wire.Armed(9), wire.Disarmed(1, reason)],
            wire.Fire: [wire.Refused(wire.RefusalReason.NOT_ARMED, 0)],
        },
    )
    one = Device(port, clock)
    token = one.arm(wire.Arm(1, 1, 0, 0, 1, 1))
    error = refused(DeviceRefusedError, "disarmed itself", one.fire, token)
    assert error.disarmed is reason
    assert "arm again" in error.hint
    port.answers[wire.Arm] = [wire.Armed(10)]
    token = one.arm(wire.Arm(1, 1, 0, 0, 1, 1))
    refused(DeviceRefusedError, "is not armed", one.fire, token)


# -- the transcript alone


def say(transcript: Transcript, direction, message, *, seq=0, ack=0, ns=0) -> list:
    return transcript.feed(direction, ns, framed(message, seq, ack))


def heard(*messages) -> Transcript:
    transcript = Transcript()
    for message in messages:
        say(transcript, "rx", message)
    return transcript


def test_a_gap_in_the_events_invents_no_edge():
    """An event in which two gates change has an edge of each, the lower gate's first."""
    transcript = heard(
        IDENTITY, events_frame(0, (110, 5)), events_frame(3, (140, 2), (150, 7)), certificate(1, 5)
    )
    drop = transcript.pending(1)
    both = (10, 0, True), (10, 2, True)
    assert drop.edges == (*both, (50, 0, True), (50, 2, True))
    assert drop.faults == (make_reason("events_missing", missing=2, events=5, first=1),)
    assert transcript.assembly(1).missing() == [1, 2]


def test_a_drop_is_given_out_once_when_acknowledged():
    transcript = heard(IDENTITY, certificate(1, 0))
    pending = transcript.pending(1)
    assert transcript.unfinished_drops() == [pending]
    assert say(transcript, "tx", wire.Acknowledge(1, 0), seq=4) == [pending]
    assert say(transcript, "tx", wire.Acknowledge(1, 0), seq=4) == []
    say(transcript, "rx", certificate(1, 0))  # a late repeat
    assert transcript.unfinished_drops() == []
    refused(KeyError, "", transcript.pending, 1)


def test_a_drop_fetched_again_by_another_session_is_given_out_again():
    transcript = heard(IDENTITY, certificate(1, 0))
    (drop,) = say(transcript, "tx", wire.Acknowledge(1, 0), seq=4)
    say(transcript, "tx", wire.Read(1, 0, 0), seq=5)
    say(transcript, "rx", certificate(1, 0), ack=5)
    assert say(transcript, "tx", wire.Acknowledge(1, 0), seq=6) == [drop]


def test_arming_again_begins_anew_but_a_repeated_answer_does_not():
    transcript = Transcript()
    order = wire.Arm(1, 0x00FF, 0, 0, 1, 1)
    say(transcript, "tx", order, seq=1)
    say(transcript, "rx", wire.Disarmed(7, wire.DisarmReason.TIMEOUT))  # answers nothing
    say(transcript, "rx", wire.Armed(9), ack=1)
    say(transcript, "rx", events_frame(0, (110, 1)))
    say(transcript, "rx", wire.Armed(9), ack=1)
    assert (transcript.assembly(1).begun, transcript.assembly(1).gates) == (True, 0x00FF)
    say(transcript, "tx", order, seq=2)
    say(transcript, "rx", wire.Armed(9), ack=2)
    assert not transcript.assembly(1).begun


def test_a_restart_is_given_with_all_that_is_known_of_it():
    """The first, behind the opening of the port, is none: it tells how long the board starts up."""
    transcript, second = Transcript(), 10**9
    transcript.feed("tx", second, b"\0")
    assert len(say(transcript, "rx", wire.Boot(1), ns=2 * second)) == 1
    say(transcript, "tx", wire.Arm(1, 1, 0, 0, 1, 1), seq=1)
    say(transcript, "rx", wire.Armed(9), ack=1)
    say(transcript, "tx", wire.Fire(9), seq=2)
    say(transcript, "rx", wire.Fired(5), ack=2, ns=5 * second)
    given = [say(transcript, "rx", wire.Boot(4), ns=at * second)[1] for at in (7, 8)]
    assert given == [Restart(7 * second, 4, 1, 2.0, 1.0), Restart(8 * second, 4, None, 0.0, 1.0)]


def test_half_a_frame_before_a_reconnect_swallows_nothing():
    transcript = Transcript()
    transcript.feed("rx", 0, framed(certificate(1, 0))[:9])
    transcript.feed("tx", 1, b"\0")
    assert say(transcript, "rx", IDENTITY, ack=1) == [Incoming(0, 1, IDENTITY)]


@pytest.mark.parametrize(("tick", "sense"), [(350, 250), (20, -80), (2**31 + 99, 2**31 - 1)])
def test_the_release_sense_counts_from_the_fire_stamp(tick, sense):
    for sensed, expected in ((1, sense), (0, None)):
        transcript = heard(replace(certificate(1, 0), sensed=sensed, sense_tick=tick))
        assert transcript.pending(1).certificate.release_sense == expected


def test_without_identity_or_certificate_the_drop_says_so():
    transcript = heard(events_frame(0, (110, 1)))
    drop = transcript.pending(1)
    assert (drop.edges, len(drop.faults)) == ((), 2)
    transcript.assembly(1).fire_tick = 100
    assert transcript.pending(1).edges == ((10, 0, True),)


def test_what_is_no_message_is_counted():
    transcript = Transcript()
    assert transcript.feed("rx", 0, encode(Frame(0xEE, 1, 0, b""))) == []
    assert transcript.unreadable == 1
    assert say(transcript, "rx", wire.Done(), ack=3, ns=8) == [Incoming(8, 3, wire.Done())]


@given(st.lists(st.tuples(st.sampled_from(["tx", "rx"]), MESSAGES, SMALL, SMALL), max_size=30))
def test_any_conversation_is_survived(said):
    transcript = Transcript()
    for direction, message, seq, ack in said:
        say(transcript, direction, message, seq=seq, ack=ack)
    for drop in transcript.unfinished_drops():
        assert drop == transcript.pending(drop.run | drop.attempt << 16)


# -- ports


def test_a_real_port_has_the_computer_s_clock():
    port = open_port("loop://")
    assert isinstance(port_clock(port), SystemClock)
    assert port.timeout == pytest.approx(0.02)
    assert serial.protocol_handler_packages.count("sim") == 1
    port.close()
    open_port("loop://").close()
    assert serial.protocol_handler_packages.count("sim") == 1


@cases
def test_when_a_board_restarted_is_said_as_well_as_it_is_known(start_up_s, when):
    assert Restart(0, 1, label=1, back_s=0.9, start_up_s=start_up_s).when == when


@pytest.fixture
def bridge():
    lab = ScriptedLab(changes=falling_rods())
    with PtyBoard(lab) as board, FarPort(board.path, "socket") as bridge:
        yield bridge


def test_a_drop_comes_whole_over_tcp_and_outlives_a_reconnect(bridge):
    chunks = []
    port, device = connected(bridge.url, lambda *chunk: chunks.append(chunk), boot_wait_s=0.5)
    device.fire(arm(device))
    drop = device.collect(LABEL)
    port.close()
    assert drop.faults == ()
    assert len(drop.edges) == len(falling_rods())
    received = [data for direction, _, data in chunks if direction == "rx"]
    assert sum(map(len, received)) / len(received) > 8  # not byte by byte
    port, again = connected(bridge.url, boot_wait_s=0.5)
    assert again.fetch(LABEL) == drop
    port.close()


def test_a_connection_that_ends_is_said(bridge):
    port, device = connected(bridge.url, boot_wait_s=0.5)
    bridge.hang_up()
    refused(DeviceError, r"the port is gone|reset by peer|Broken pipe", device.status)
    port.close()


def test_what_has_arrived_is_counted():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = open_port(f"socket://127.0.0.1:{server.getsockname()[1]}")
        other, _ = server.accept()
        with other:
            other.sendall(bytes(300))
            until(lambda: port.in_waiting == 300)
            assert port.read(300) == bytes(300)
            assert port.in_waiting == 0
            assert port.read(1) == b""  # nobody sends any more, and nothing is waited for
        port.close()
    refused(OSError, "", getattr, port, "in_waiting")


def test_nothing_listens():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        number = free.getsockname()[1]
    nobody = f"socket://127.0.0.1:{number}"
    check_url(nobody)
    assert "HOST:PORT" in refused(DeviceError, f":{number}: Connection ref", open_port, nobody).hint


@pytest.mark.parametrize("url", ["socket://lab", "socket://127.0.0.1:99999", "socket://"])
def test_what_is_no_address(url):
    assert "HOST:PORT" in refused(DeviceError, f"cannot open {url}: ", open_port, url).hint


def test_a_missing_emulator_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "rig_emulator", None)  # importing it now fails
    error = refused(DeviceError, "emulator is not installed", open_port, "emu://?protocol=x.yaml")
    assert "./firmware/emulator" in error.hint
    assert "libsimavr-dev" in error.hint
