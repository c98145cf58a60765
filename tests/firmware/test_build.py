"""The firmware as it is built: its sources, its sizes and the images that the package ships."""

import re
import shutil
import struct

import pytest

from firmware.size import measure
from rig.flash.boards import TARGETS
from rig.flash.image import read_image
from tests.firmware.toolchain import FIRMWARE, make, need
from tests.programs import run_program
from tests.tables import cases, read_table

CHECKED = read_table(__file__, "cppcheck")


@pytest.mark.parametrize("board", [*CHECKED][1:])
def test_cppcheck_finds_nothing_in_it_as_each_board_compiles_it(board):
    need("cppcheck")
    words = f'{CHECKED["every board"]} -DFIRMWARE_VERSION="0" -I{board} {CHECKED[board]}'
    run_program("cppcheck", *words.split(), cwd=FIRMWARE)


HOST = (FIRMWARE / "host" / "board.h").read_text()
API = (FIRMWARE / "core" / "board_api.h").read_text()


def compiled(folder, board):
    need("gcc")
    (folder / "board.h").write_text(board)
    (folder / "it.c").write_text('#include "board_api.h"\n')
    command = "gcc", "-std=gnu11", "-fsyntax-only", "-I.", f"-I{FIRMWARE / 'core'}", "it.c"
    return run_program(*command, code=None, cwd=folder)


@cases
def test_what_a_board_lacks_is_named(tmp_path, there, instead, named):
    assert compiled(tmp_path, HOST).returncode == 0
    done = compiled(tmp_path, HOST.replace(there, instead))
    assert done.returncode
    assert named in done.stderr


def test_the_core_asks_for_nothing_else():
    """The one place where `board.h` is included, and every word of a board's that the core uses."""
    words = set()
    for source in sorted((FIRMWARE / "core").glob("*.[ch]")):
        if source.name != "board_api.h":
            assert '"board.h"' not in source.read_text(), source
            words |= set(re.findall(r"\b(?:board|BOARD)_\w+", source.read_text()))
    assert words - {"board_api"} <= set(re.findall(r"\b(?:board|BOARD)_\w+", API))


BOARDS = {"mega": "atmega2560", "uno": "atmega328p"}
SPARE = 64
"""Bytes of stack that must stay unused in the worst case."""


@pytest.mark.parametrize("board", BOARDS)
def test_a_board_has_room(board):
    need("avr-objdump", "avr-nm", "avr-size")
    make("all")
    found = measure(FIRMWARE / "build" / BOARDS[board])
    assert found.stack + SPARE <= found.room, found
    assert found.flash <= TARGETS[board].flash_limit, found
    # A chain of calls that is not found would make the bound too low.
    assert found.path[:2] == ("main", "device_pass"), found
    assert found.path[-1].startswith("__vector_"), found


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


SOURCES = (
    "core", "avr", "atmega2560", "atmega328p", "pico", "rp2040", "rp2350", "Makefile", "size.py",
)  # fmt: skip
EACH = pytest.mark.parametrize("target", TARGETS.values(), ids=TARGETS)
COMPILERS = {"avr-gcc": "PREBUILT_WITH", "arm-none-eabi-gcc": "PICO_PREBUILT_WITH"}


@pytest.fixture(scope="module")
def images(tmp_path_factory):
    """Copy the sources, build them, and say where the images are."""
    folder = tmp_path_factory.mktemp("prebuilt") / "another name" / "much deeper"
    need("make", *COMPILERS, "avr-objcopy")
    makefile = (FIRMWARE / "Makefile").read_text()
    for compiler, name in COMPILERS.items():
        wanted = re.search(rf"^{name} = (.+)$", makefile, re.MULTILINE)
        found = run_program(compiler, "-dumpversion")
        if found.stdout.strip() != wanted[1]:
            pytest.skip(f"the images are made with {compiler} {wanted[1]}, here is {found.stdout}")
    firmware, images = folder / "firmware", folder / "rig" / "flash"
    images.mkdir(parents=True)
    firmware.mkdir()
    for name in SOURCES:
        copy = shutil.copytree if (FIRMWARE / name).is_dir() else shutil.copy
        copy(FIRMWARE / name, firmware / name)
    run_program("make", "-C", firmware, "prebuilt", timeout=None)
    return images


@EACH
def test_the_shipped_image_is_what_the_sources_make_in_any_folder(target, images):
    stale = "the sources have changed since: make -C firmware prebuilt"
    assert (images / target.image).read_bytes() == target.image_path.read_bytes(), stale


@EACH
def test_the_shipped_image_is_whole_and_for_its_board(target):
    version = re.search(r"^VERSION = (.+)$", (FIRMWARE / "Makefile").read_text(), re.MULTILINE)
    image = read_image(target.image_path, target)
    assert image.firmware == f"chainrig {version[1]}"
    assert 4096 < image.size < target.flash_limit
