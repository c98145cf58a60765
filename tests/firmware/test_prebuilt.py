"""The images that the package ships are what the sources make, wherever they are built."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from rig.flash.boards import TARGETS
from rig.flash.image import read_image
from tests.firmware.toolchain import FIRMWARE, need

SOURCES = (
    "core", "avr", "atmega2560", "atmega328p", "pico", "rp2040", "rp2350", "Makefile", "size.py",
)  # fmt: skip
EACH = pytest.mark.parametrize("target", TARGETS.values(), ids=TARGETS)
COMPILERS = {"avr-gcc": "PREBUILT_WITH", "arm-none-eabi-gcc": "PICO_PREBUILT_WITH"}


def built_in(folder: Path) -> Path:
    """Copy the sources there, build them, and say where the images are."""
    need("make", *COMPILERS, "avr-objcopy")
    makefile = (FIRMWARE / "Makefile").read_text()
    for compiler, name in COMPILERS.items():
        wanted = re.search(rf"^{name} = (.+)$", makefile, re.MULTILINE)
        found = subprocess.run(
            [compiler, "-dumpversion"], capture_output=True, text=True, check=True
        )
        if found.stdout.strip() != wanted[1]:
            pytest.skip(f"the images are made with {compiler} {wanted[1]}, here is {found.stdout}")
    firmware, images = folder / "firmware", folder / "rig" / "flash"
    images.mkdir(parents=True)
    firmware.mkdir()
    for name in SOURCES:
        copy = shutil.copytree if (FIRMWARE / name).is_dir() else shutil.copy
        copy(FIRMWARE / name, firmware / name)
    done = subprocess.run(
        ["make", "-C", firmware, "prebuilt"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return images


@pytest.fixture(scope="module")
def images(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built_in(tmp_path_factory.mktemp("prebuilt") / "another name" / "much deeper")


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
