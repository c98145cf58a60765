"""rig flash with an avrdude that flashes nothing, and which files may be flashed on which board."""

import pytest
import serial

from rig import boards
from rig.errors import InputError
from rig.flash.boards import TARGETS
from rig.flash.image import read_image
from tests.flash.pty_board import PtyBoard, silent_port
from tests.refusals import refused
from tests.tables import cases

VERSION = read_image(TARGETS["mega"].image_path, TARGETS["mega"]).firmware
NAMES = {"board": "Arduino Mega 2560", "firmware": VERSION}
UNO, MEGA = TARGETS["uno"], TARGETS["mega"]


def options(argv):
    return dict(zip(argv[::2], argv[1::2], strict=True))


@pytest.mark.parametrize("board", ["mega", "uno", "nano-old"])
def test_a_board_is_flashed_and_asked(board, avrdude, flash):
    target = TARGETS[board]
    with PtyBoard(board=target.board.name, firmware=VERSION) as there:
        done = flash("--port", there.path, board=board)
    assert done.out.startswith(f"{target.board.name}, {VERSION}, 16 gates, id ")
    assert done.out.endswith(": flashed and verified\n")
    assert done.out.count("\n") == 1
    assert f"writing {VERSION} (" in done.err
    assert "Writing | ######## | 100%" in done.err
    argv = avrdude.noted.read_text().splitlines()
    argv.remove("-D")
    assert options(argv) == {
        "-p": "m2560" if board == "mega" else "m328p",
        "-c": "wiring" if board == "mega" else "arduino",
        "-b": "57600" if board == "nano-old" else "115200",
        "-P": there.path,
        "-U": f"flash:w:{target.image_path}:i",
    }


def test_another_image_and_another_avrdude(avrdude, flash, tmp_path, monkeypatch):
    hex_file = tmp_path / "my own.hex"
    hex_file.write_bytes(TARGETS["mega"].image_path.read_bytes())
    monkeypatch.setenv("PATH", str(tmp_path / "empty"))
    with PtyBoard(**NAMES) as there:
        flash("--port", there.path, "--hex", hex_file, "--avrdude", avrdude.path)
    assert f"flash:w:{hex_file}:i" in avrdude.noted.read_text()


# What avrdude 6.3 and 7.1 say.
@cases
def test_avrdude_fails(says, message, avrdude, flash):
    avrdude.will(says, 1)
    with silent_port() as path:
        done = flash("--port", path, code=4)
    for words in (says, f"flashing {path} failed: ", message, "hint: "):
        assert words in done.err


@cases
def test_nothing_is_flashed_where_something_is_wrong(
    arguments, code, message, avrdude, flash, tmp_path
):
    program = tmp_path / "broken"
    program.write_bytes(b"#!/nowhere/at-all\n")
    program.chmod(0o755)
    with silent_port() as path:
        places = {"SILENT": path, "BROKEN": program, "UNO": UNO.image_path}
        done = flash(*(places.get(word, word) for word in arguments), code=code)
    assert message in done.err
    assert not avrdude.noted.exists()


def test_avrdude_is_missing(flash, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with silent_port() as path:
        done = flash("--port", path, code=2)
    assert "apt-get install avrdude" in done.err


def test_a_port_somebody_uses(avrdude, flash):
    with silent_port() as path, serial.Serial(path, exclusive=True):
        done = flash("--port", path, code=4)
    assert "another program uses it" in done.err
    assert not avrdude.noted.exists()


@pytest.mark.parametrize(
    "names", [{**NAMES, "board": "Arduino Uno"}, {**NAMES, "firmware": "chainrig 0.0.1"}]
)
def test_the_board_says_something_else(names, avrdude, flash):
    with PtyBoard(**names) as there:
        done = flash("--port", there.path, code=4)
    assert f"answers as {names['board']}, {names['firmware']}" in done.err


def test_the_board_says_nothing(avrdude, flash, monkeypatch):
    monkeypatch.setattr("rig.link.client.LOADER_WAIT_S", 0.1)
    monkeypatch.setattr("rig.link.exchange._LONGEST_WAIT_S", 0.0)
    with silent_port() as path:
        done = flash("--port", path, code=4)
    assert "written; asking the board who it is" in done.err
    assert "the device did not answer Identify" in done.err


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
    def write(text: str):
        path = tmp_path / "it.hex"
        path.write_bytes(text.encode("latin-1"))
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
        damaged = file(f"{line[:n]}{other}{line[n + 1 :]}\n{end}\n")
        refused(InputError, r"it\.hex:1:1: ", read_image, damaged, UNO)


@cases
def test_what_must_not_be_flashed(file, text, says):
    refused(InputError, says, read_image, file(text), UNO)


def test_a_file_that_is_not_there(tmp_path):
    refused(InputError, "No such file", read_image, tmp_path / "none.hex", UNO)
