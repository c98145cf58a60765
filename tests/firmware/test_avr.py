"""Both AVR boards' real binaries in the emulator: the suite, stamps, release, wires and name."""

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.link import messages as wire
from rig.link.frames import Decoder
from rig.protocol import reader
from rig_emulator import trials
from rig_emulator.avr import Avr
from rig_emulator.board import EmulatedBoard
from rig_emulator.name import NAME_AT
from rig_emulator.protocol_emu import EmulatedSerial
from rig_emulator.stand import Flip, Stand
from rig_emulator.wiring import BOARDS
from sim.dials import read_dials
from sim.lab import ChainLab
from tests.firmware.toolchain import FIRMWARE, make
from tests.link.bench import LABEL, Bench
from tests.link.conformance import DeviceConformance
from tests.link.talk import Wire, arm, framed

_TURN_TICKS = 1 << 16


def image_for(wiring):
    return make(f"build/{wiring.mcu}/firmware.elf")


class AvrBench(Bench):
    serial_type = EmulatedSerial
    touch_s = 1e-3
    tick_tolerance = 5  # an edge waits for the instruction that it interrupts

    def __init__(self, lab, name):
        wiring = BOARDS[name]
        self.can_sense = wiring.sense is not None
        super().__init__(lab, EmulatedBoard(wiring, image_for(wiring), lab, seed=1, ppm=2000))

    def preset_tick(self, seconds_before_wrap):
        avr = self.now().avr
        upper = 2**16 - round(seconds_before_wrap * 16e6) // _TURN_TICKS
        lower = avr.peek("looked")[:2]  # must go on with the counter
        avr.poke("looked", lower + upper.to_bytes(2, "little"))


class AvrConformance(DeviceConformance):
    # The emulator needs long for what is mostly waiting: one bad line is enough here.
    @pytest.mark.parametrize("seed", [1])
    def test_one_percent_of_damaged_bytes_changes_nothing(self, bench, seed):
        super().test_one_percent_of_damaged_bytes_changes_nothing(bench, seed)

    def test_the_lamp_is_on_while_armed_and_flashes_while_a_drop_is_held(self, bench, device):
        def seen(seconds):
            found = set()
            for _ in range(20):
                bench.clock().sleep(seconds / 20)
                found.add(bench.now().avr.output(bench.board.wiring.led))
            return found

        assert seen(0.1) == {False}
        token = arm(device, record_ms=50)
        assert seen(0.1) == {True}
        device.fire(token)
        assert seen(0.04) == {True}
        device.collect(LABEL)
        assert seen(1.1) == {True, False}

    def test_a_gate_that_only_flickers_after_arming_forbids_fire(self, bench, device):
        token = arm(device)
        bench.now().touch(2)
        bench.clock().sleep(2e-7)
        bench.now().touch(0)
        assert self.refused(wire.RefusalReason.GATE_UNSTEADY, device.fire, token).detail == 0

    @pytest.mark.parametrize("byte", [0x00, 0x5A, 0xFF])
    def test_memory_that_was_lost_while_the_power_was_low_is_not_believed(self, bench, byte):
        Wire(bench).drop()
        avr = bench.board.avr
        for kept in ("drop", "seal", "restarts"):
            avr.poke(kept, bytes([byte]) * len(avr.peek(kept)))
        bench.brown_out()
        assert Wire(bench).ask(wire.Status(), 1).phase is wire.Phase.IDLE
        _, certificate = Wire(bench).drop()
        assert certificate.restarts == 128 | bench.brown_out_cause


class TestMega(AvrConformance):
    def make(self, lab):
        return AvrBench(lab, "mega")


class TestUno(AvrConformance):
    def make(self, lab):
        return AvrBench(lab, "uno")


SCENE = str(FIRMWARE.parent / "protocols/inclined-uniform.yaml")


def stand_of(name, **changes):
    wiring = BOARDS[name]
    return Stand(wiring, image_for(wiring), **changes)


@pytest.fixture(scope="module", params=list(BOARDS))
def stand(request):
    return stand_of(request.param)


@pytest.fixture(scope="module")
def mega():
    return stand_of("mega")


def test_a_drop_of_both_chains(mega):
    lab = ChainLab(reader.read(SCENE), read_dials({}), seed=3)
    stamps = [stamp for run in (1, 2) for stamp in trials.lab_drop(mega, lab, run)]
    seen = trials.spread(stamps)
    assert seen.count > 1200
    assert abs(seen.mean) < 1
    assert seen.sd <= 1.5
    assert seen.p99 <= 5
    assert seen.worst <= 56
    assert seen.worst_trusted <= 8
    assert 0 < seen.doubtful < 0.06 * seen.count


def test_an_edge_at_every_cycle_around_the_counter_s_turn(stand):
    stamps = trials.across_halves(stand, 200)
    assert len(stamps) == 401
    assert max(abs(stamp.error) for stamp in stamps) <= 8


def test_5000_edges_a_second(mega):
    assert trials.sustained(mega, 1000, 5000) == (1000, 0)


def test_a_board_that_streams_keeps_up_with_4500_edges_a_second():
    assert trials.sustained(stand_of("uno"), 5000, 4500) == (5000, 0)


def test_8000_edges_a_second_at_1_mbaud(mega):
    fast = Stand(BOARDS["mega"], make("build/1M/atmega2560/firmware.elf"), 1_000_000)
    assert trials.sustained(fast, 1000, 8000) == (1000, 0)


@pytest.mark.parametrize("spacing", [4001, 24_001])
def test_edges_that_meet_are_doubtful_and_not_far_off(mega, spacing):
    """The short spacing leaves the main loop no rest: its time must go on all the same."""
    seen = trials.spread(trials.twins(mega, 250, spacing))
    assert seen.count == 1000
    assert seen.worst <= 56
    assert seen.worst_trusted <= 8


def test_all_gates_in_the_same_cycle_are_one_event(stand):
    gates = range(len(stand.wiring.gates))
    flips = [Flip(30_000, gate, True) for gate in gates]
    flips += [Flip(60_000, gate, False) for gate in gates]
    recording = stand.record(flips, 20)
    assert [event.state for event in recording.events] == [(1 << len(gates)) - 1, 0]
    assert recording.certificate.glitches == 0
    assert max(abs(stamp.error) for stamp in recording.stamps(flips)) <= 8


@pytest.mark.parametrize("gate", [0, 11])
def test_every_short_pulse_is_seen_or_counted(stand, gate):
    for width in range(1, 60):
        edges, glitches = trials.pulse(stand, gate, width)
        assert edges == 2 * (16 - glitches)
        assert not (width < 8 and edges)
        assert not (width > 24 and glitches)


def test_a_talking_host_costs_little(mega):
    flips = trials.train(16, 400, 2000)
    seen = trials.spread(mega.record(flips, 400, noise=bytes(range(1, 256)) * 20).stamps(flips))
    assert seen.worst <= 12


def test_the_stack_has_room_and_the_watchdog_slept(stand):
    assert stand.avr.stack_free() >= 64
    assert stand.avr.watchdog_resets == 0
    assert stand.avr.overruns == 0


_US = 16


def pulses(stand, recording):
    """Say when each release changed."""
    return [[c.cycle for c in recording.outputs if c.pin == pin] for pin in stand.wiring.releases]


@pytest.mark.parametrize("rate", [100_000, 320_000, 400_000, 1_000_000])
def test_gates_that_never_rest_do_not_lengthen_it(stand, rate):
    recording = trials.storm(stand, rate, 20_000)
    assert pulses(stand, recording) == [[0, 20_000 * _US]] * 2
    assert recording.certificate.pulse_ticks == 20_000 * _US
    assert recording.certificate.pulse_end == wire.PulseEnd.ORDERED
    assert recording.certificate.overflows > 0
    assert stand.avr.watchdog_resets == 0
    flips = trials.train(len(stand.wiring.gates), 100, 2000)
    seen = trials.spread(stand.record(flips, 80).stamps(flips))
    assert seen.worst <= 8, "its time went on"


@pytest.mark.parametrize("pulse_us", [1, 10, 4_090, 4_097, 61_000])
def test_a_pulse_is_as_long_as_ordered(stand, pulse_us):
    stand.hear(200_000 * _US)  # it rests three times as long as it was on
    recording = stand.record([], pulse_us // 1000 + 2, pulse_us=pulse_us)
    for on, off in pulses(stand, recording):
        assert on == 0
        assert off == pulse_us * _US or (pulse_us < 10 and off <= 30 * _US)
        assert abs(recording.certificate.pulse_ticks - off) <= 2 * _US


def test_the_sync_output_is_with_it(stand):
    stand.hear(200_000 * _US)
    recording = stand.record([Flip(1000, 0, True)], 5, pulse_us=1000)
    sync = [c.cycle for c in recording.outputs if c.pin == stand.wiring.sync]
    assert -4 <= sync[0] <= 0
    assert abs(sync[1] / 16e3 - 5) < 0.5


@pytest.mark.parametrize("name", list(BOARDS))
def test_a_main_loop_that_stands_still_ends_it_and_restarts_the_board(name):
    stand = stand_of(name)
    avr = stand.avr
    stand.arm_and_fire(500, 400_000)
    stand.hear(20_000 * _US)
    assert all(map(avr.output, stand.wiring.releases))
    avr.take_changes()
    avr.hang("device_pass")
    still = avr.cycle
    stand.hear(200_000 * _US)
    ends = [c.cycle - still for c in avr.take_changes() if c.pin in stand.wiring.releases]
    assert len(ends) == 2
    assert max(ends) < 4_100 * _US
    assert avr.watchdog_resets > 0


@pytest.mark.parametrize("name", BOARDS)
def test_pins_that_nothing_drives_are_blocked_gates(name):
    wiring = BOARDS[name]
    avr = Avr(image_for(wiring), wiring.mcu)
    avr.edge(0, wiring.gates[3], False)
    avr.run(500_000)
    avr.take_sent()
    avr.receive(framed(wire.Status()))
    avr.run(700_000)
    (frame,) = Decoder().feed(bytes(sent.value for sent in avr.take_sent()))
    every = (1 << len(wiring.gates)) - 1
    assert wire.unpack(frame.type, frame.payload).gates == every & ~(1 << 3)


EACH = pytest.mark.parametrize("board", BOARDS)


@EACH
def test_boards_whose_memory_was_cleared_get_names_of_their_own(board):
    names = [stand_of(board, named=b"", waits=waits).identity.unique_id for waits in (0, 997, 5000)]
    assert len({*names, bytes(8)}) == 4
    assert all(len({*byte}) > 1 for byte in zip(*names, strict=True))


@EACH
@pytest.mark.parametrize("at", [0, 5, 11])
def test_a_damaged_name_is_none_and_is_replaced_once(board, at):
    stand = stand_of(board)
    assert stand.identity.unique_id == b"on stand"
    (byte,) = stand.avr.eeprom_read(NAME_AT + at, 1)
    stand.avr.eeprom_write(NAME_AT + at, bytes([byte ^ 4]))
    new = stand.ask(wire.Identify()).unique_id
    assert new != b"on stand"
    stand.avr.reset()
    stand.hear(1_000_000)
    assert stand.ask(wire.Identify()).unique_id == new
