"""Which files may be flashed onto which board."""

import pytest

from rig import boards
from rig.errors import InputError
from rig.flash.boards import TARGETS
from rig.flash.image import read_image

UNO, MEGA = TARGETS["uno"], TARGETS["mega"]
END = ":00000001FF\n"


def record(address: int, data: bytes, kind: int = 0) -> str:
    body = bytes([len(data), *address.to_bytes(2, "big"), kind, *data])
    return f":{body.hex().upper()}{-sum(body) & 0xFF:02X}\n"


def image(*names: bytes) -> str:
    return record(0x100, b"\0".join([*names, b""])) + END


GOOD = (b"chainrig 2.3.1", b"Arduino Uno")


def test_every_board_of_the_table_can_be_flashed():
    assert {word: target.board for word, target in TARGETS.items()} == {
        **boards.BOARDS,
        "nano-old": boards.UNO,
    }


@pytest.fixture
def file(tmp_path):
    def write(text: str | bytes):
        path = tmp_path / "it.hex"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


@pytest.mark.parametrize("ends", ["\n", "\r\n"])
def test_names_and_size_are_read_from_the_image(ends, file):
    path = file(image(*GOOD).replace("\n", ends))
    found = read_image(path, UNO)
    assert (found.path, found.firmware) == (path, "chainrig 2.3.1")
    assert found.size == 0x100 + sum(len(name) + 1 for name in GOOD)


@pytest.mark.parametrize(("kind", "value"), [(2, 0x3000), (4, 0x3)])
def test_addresses_beyond_64_kb(file, kind, value):
    text = record(0, value.to_bytes(2, "big"), kind) + image(b"chainrig 1", b"Arduino Mega 2560")
    base = value * 16 if kind == 2 else value << 16
    assert read_image(file(text), MEGA).size > base


def test_names_may_go_over_the_end_of_a_record(file):
    text = b"\0".join([*GOOD, b""])
    pieces = [record(n, text[n : n + 5]) for n in range(0, len(text), 5)]
    assert read_image(file("".join(pieces[::-1]) + END), UNO).firmware == "chainrig 2.3.1"


def test_every_damaged_digit_is_found(file):
    line, end = image(*GOOD).splitlines()
    for n in range(1, len(line)):
        other = "0" if line[n] != "0" else "1"
        with pytest.raises(InputError, match=r"it\.hex:1:1: "):
            read_image(file(f"{line[:n]}{other}{line[n + 1 :]}\n{end}\n"), UNO)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (record(0, b"hello") + END, "is no firmware of this rig"),
        (image(b"chainrig 1"), "is no firmware of this rig"),
        (image(b"chainrig 1", b"chainrig 2", b"Arduino Uno"), "is no firmware of this rig"),
        (image(b"chainrig 1", b"Arduino Uno", b"Arduino Mega 2560"), "is no firmware of this rig"),
        (image(b"chainrig 1", b"Arduino Mega 2560"), "is for an Arduino Mega 2560"),
        (image(*GOOD).replace(END, ""), r"it\.hex:2:1: no whole record"),
        ("", r"it\.hex:1:1: no whole record"),
        (END + image(*GOOD), "is no firmware of this rig"),
        (image(*GOOD).replace(":", "", 1), r"it\.hex:1:1: no whole record"),
        (":02000000AB53\n" + image(*GOOD), r"it\.hex:1:1: no whole record"),  # one byte of two
        (record(0, b"", kind=9) + END, r"it\.hex:1:1: no whole record"),
        (record(0, b"\xff\xff", kind=4) + image(*GOOD), "would overwrite the boot loader"),
        (record(0x7E00, b"x") + image(*GOOD), "would overwrite the boot loader"),
        (b"\xff\xfe\x00", "no whole record of an Intel HEX file"),
    ],
)
def test_what_must_not_be_flashed(file, text, says):
    with pytest.raises(InputError, match=says):
        read_image(file(text), UNO)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        read_image(tmp_path / "none.hex", UNO)
