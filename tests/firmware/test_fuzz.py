"""Anything at all before the core and the real binaries: no fault, and no pulse unasked for."""

import struct
import subprocess

import pytest
from hypothesis import given
from hypothesis import strategies as st

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.link import messages as wire
from rig_emulator.fuzz import Fuzz
from rig_emulator.wiring import BOARDS, PICO, firmware_for
from tests.examples import examples
from tests.firmware.pico import build
from tests.firmware.toolchain import make


@pytest.fixture(scope="module", params=["whole", "streams"])
def survivor(request):
    """A process that answers each input it survives: how often did the release go on?"""
    program = make(f"build/host/fuzz-{int(request.param == 'streams')}")
    with subprocess.Popen(program, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:

        def run(script: bytes) -> int:
            process.stdin.write(struct.pack("<I", len(script)) + script)
            process.stdin.flush()
            return int(process.stdout.readline() or -1)

        yield run
        process.stdin.close()


def frame(message: wire.HostMessage, seq: int) -> bytes:
    """The script's way to say: a frame with this content and the right CRC."""
    code, payload = wire.pack(message)
    body = bytes((code, seq, 0)) + payload
    return bytes((1 | len(body) << 3, 0)) + body


seqs = st.integers(1, 255)
arms = st.builds(
    wire.Arm,
    label=st.integers(1, 2),
    gates=st.sampled_from([1, 0x8001, 0xFFFF]),
    release=st.sampled_from([0, 1, 3]),
    pulse_us=st.sampled_from([0, 100, 80_000, 500_000]),
    timeout_ms=st.sampled_from([1, 100, 5000]),
    record_ms=st.sampled_from([1, 50, 1000]),
)
others = st.sampled_from(
    [
        *(wire.Identify(), wire.Ping(), wire.Status(), wire.Abort(), wire.Reference()),
        *(wire.Read(1, 0, 5), wire.Read(1, 0, 0), wire.Acknowledge(1, 0)),
    ]
)
steps = st.one_of(
    st.builds(frame, st.one_of(arms, others), seqs),
    st.builds(lambda seq: bytes((2, seq)), seqs),  # FIRE with the right token
    st.builds(
        lambda gate, gap: bytes((4 | gate << 3, gap)), st.integers(0, 31), st.integers(0, 255)
    ),
    st.builds(lambda shift, value: bytes((3 | shift << 3, value)), st.integers(0, 15), seqs),
    st.builds(lambda opened: bytes((5, opened)), st.integers(0, 1)),
    st.builds(lambda value: bytes((7, value)), st.integers(0, 255)),
    st.binary(max_size=40),
)


@examples(300)
@given(st.lists(steps, max_size=60).map(b"".join))
def test_no_input_breaks_the_core_or_holds_the_release(survivor, script):
    assert survivor(script) >= 0


@pytest.mark.parametrize("events", [0, 40, 1100])
def test_drops_that_the_script_fires_reads_and_acknowledges_break_nothing(survivor, events):
    """Few events, and more than there is room for."""
    soon, wait = bytes((3 | 8 << 3, 255)), bytes((3 | 15 << 3, 255))  # 65 thousand ticks, 8 million
    blinks = b"".join(bytes((4 | (n + 1) % 2 << 7, 200)) for n in range(events))
    reads = b"".join(frame(wire.Read(1, *part), n) for n, part in enumerate(((0, 0), (2, 40)), 5))
    drop = frame(wire.Arm(1, 1, 1, 500_000, 5000, 1000), 1) + soon + bytes((2, 2)) + blinks
    # It is read behind a reset, and given up, before the next.
    drop += 2 * wait + bytes((7, 4)) + reads + bytes((2 | 1 << 3, 7)) + 3 * wait
    assert survivor(drop + drop) == 2, "or else the test above would show nothing of the release"


def judge_pulses(wiring, steps: int, least: int) -> None:
    fuzz = Fuzz(wiring, firmware_for(wiring), seed=3)
    for _ in range(steps):
        fuzz.step()
    assert fuzz.judge.faults == []
    assert fuzz.judge.pulses["ordered"] >= least, "or else this would show nothing"
    assert fuzz.avr.watchdog_resets == 0


@pytest.mark.parametrize("name", BOARDS)
def test_every_pulse_was_armed_and_fired(name):
    make("all")
    judge_pulses(BOARDS[name], steps=150, least=3)


def test_every_pulse_of_a_pico_was_too():
    """More of them: ./run bench fuzz."""
    build()
    judge_pulses(PICO, steps=25, least=1)
