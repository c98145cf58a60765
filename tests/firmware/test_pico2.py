"""The image for a Pico 2 is one that its chip's own program starts; no emulator runs it yet."""

import struct

from tests.firmware.toolchain import FIRMWARE, make, need

RAM = range(0x20000000, 0x20082000)


def test_the_chips_own_program_finds_what_it_starts():
    need("arm-none-eabi-gcc")
    make("pico2")
    image = (FIRMWARE / "build/rp2350/firmware.bin").read_bytes()
    stack, start, failed, *vectors = struct.unpack_from("<68I", image)  # 16 and 52 of the chip
    assert stack in RAM
    assert start & 1, "Thumb"
    assert start - 0x10000000 in range(len(image))
    own = {n - 13: vector for n, vector in enumerate(vectors) if vector != failed}
    assert own.keys() == {0, 14}, "TIMER0_IRQ_0 and USBCTRL_IRQ"
    assert all(vector in RAM for vector in own.values())
    # An image for an RP2350, secure, for Arm; the only block (data sheet, 5.9.3.1 and 5.9.5.1).
    block = struct.pack("<IBBHBHBII", 0xFFFFDED3, 0x42, 1, 0x1021, 0xFF, 1, 0, 0, 0xAB123579)
    assert image.index(block) % 4 == 0
    assert image.index(block) + len(block) <= 4096
    drive = (FIRMWARE / "build/rp2350/firmware.uf2").read_bytes()
    blocks = [drive[at : at + 512] for at in range(0, len(drive), 512)]
    assert {block[28:32] for block in blocks} == {(0xE48BFF59).to_bytes(4, "little")}
    assert b"".join(block[32:288] for block in blocks).startswith(image)
