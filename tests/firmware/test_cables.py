"""A gate whose wire is broken reads blocked."""

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.link import messages as wire
from rig.link.frames import Decoder, Frame, encode
from rig_emulator.avr import Avr
from rig_emulator.wiring import BOARDS
from tests.firmware.toolchain import FIRMWARE, make


@pytest.mark.parametrize("name", BOARDS)
def test_pins_that_nothing_drives_are_blocked_gates(name):
    wiring = BOARDS[name]
    image = f"build/{wiring.mcu}/firmware.elf"
    make(image)
    avr = Avr(FIRMWARE / image, wiring.mcu)
    avr.edge(0, wiring.gates[3], False)
    avr.run(500_000)
    avr.take_sent()
    code, payload = wire.pack(wire.Status())
    avr.receive(encode(Frame(code, 1, 0, payload)))
    avr.run(700_000)
    (frame,) = Decoder().feed(bytes(sent.value for sent in avr.take_sent()))
    every = (1 << len(wiring.gates)) - 1
    assert wire.unpack(frame.type, frame.payload).gates == every & ~(1 << 3)
