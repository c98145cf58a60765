"""``rig flash``, with an avrdude that flashes nothing and a board that is there already."""

import os
import pty
from contextlib import contextmanager

import pytest
import serial

from rig.flash.boards import TARGETS
from rig.flash.image import read_image
from tests.flash.pty_board import PtyBoard
from tests.tables import cases

VERSION = read_image(TARGETS["mega"].image_path, TARGETS["mega"]).firmware
NAMES = {"board": "Arduino Mega 2560", "firmware": VERSION}
PTY = "where nobody answers"
OTHER = "is for an Arduino Uno, not for an Arduino Mega 2560"


@contextmanager
def silent_port():
    """Open a port behind which nobody answers."""
    ends = pty.openpty()
    try:
        yield os.ttyname(ends[1])
    finally:
        for end in ends:
            os.close(end)


def options(argv):
    return dict(zip(argv[::2], argv[1::2], strict=True))


@pytest.mark.parametrize("board", ["mega", "uno", "nano-old"])
def test_a_board_is_flashed_and_asked(board, avrdude, flash):
    target = TARGETS[board]
    with PtyBoard(board=target.board.name, firmware=VERSION) as there:
        code, out, err = flash("--port", there.path, board=board)
    assert code == 0, err
    assert out.startswith(f"{target.board.name}, {VERSION}, 16 gates, id ")
    assert out.endswith(": flashed and verified\n")
    assert out.count("\n") == 1
    assert f"writing {VERSION} (" in err
    assert "Writing | ######## | 100%" in err
    argv = list(avrdude.argv)
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
        code, _, err = flash("--port", there.path, "--hex", hex_file, "--avrdude", avrdude.path)
    assert code == 0, err
    assert f"flash:w:{hex_file}:i" in avrdude.argv


# What avrdude 6.3 and 7.1 say.
@cases
def test_avrdude_fails(says, message, avrdude, flash):
    avrdude.will(says, 1)
    with silent_port() as path:
        code, out, err = flash("--port", path)
    assert (code, out) == (4, "")
    for words in (says, f"flashing {path} failed: ", message, "hint: "):
        assert words in err


def broken_program(folder):
    program = folder / "broken"
    program.write_bytes(b"#!/nowhere/at-all\n")
    program.chmod(0o755)
    return program


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (lambda _: ["--port", PTY, "--avrdude", "/none"], 2, "cannot run /none: No such file"),
        (lambda d: ["--port", PTY, "--avrdude", broken_program(d)], 2, "cannot run"),
        (lambda _: ["--port", "/dev/null", "--hex", TARGETS["uno"].image_path], 2, OTHER),
        (lambda d: ["--port", d / "ttyACM0"], 4, "there is no such port"),
        *(
            (lambda _, url=url: ["--port", url], 2, f"{url} is no board that can be flashed")
            for url in ("sim://", "emu://", "replay://x", "socket://lab:7")
        ),
    ],
)
def test_nothing_is_flashed_where_something_is_wrong(
    arguments, code, message, avrdude, flash, tmp_path
):
    with silent_port() as path:
        given = [path if word is PTY else word for word in arguments(tmp_path)]
        result, _, err = flash(*given)
    assert result == code
    assert message in err
    assert avrdude.argv is None


def test_avrdude_is_missing(flash, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with silent_port() as path:
        code, _, err = flash("--port", path)
    assert code == 2
    assert "apt-get install avrdude" in err


def test_a_port_somebody_uses(avrdude, flash):
    with silent_port() as path, serial.Serial(path, exclusive=True):
        code, _, err = flash("--port", path)
    assert code == 4
    assert "another program uses it" in err
    assert avrdude.argv is None


@pytest.mark.parametrize(
    "names", [{**NAMES, "board": "Arduino Uno"}, {**NAMES, "firmware": "chainrig 0.0.1"}]
)
def test_the_board_says_something_else(names, avrdude, flash):
    with PtyBoard(**names) as there:
        code, out, err = flash("--port", there.path)
    assert (code, out) == (4, "")
    assert f"answers as {names['board']}, {names['firmware']}" in err


def test_the_board_says_nothing(avrdude, flash, monkeypatch):
    monkeypatch.setattr("rig.link.client.LOADER_WAIT_S", 0.1)
    monkeypatch.setattr("rig.link.exchange._LONGEST_WAIT_S", 0.0)
    with silent_port() as path:
        code, out, err = flash("--port", path)
    assert (code, out) == (4, "")
    assert "written; asking the board who it is" in err
    assert "the device did not answer Identify" in err
