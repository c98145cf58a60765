"""Building the firmware, for the tests."""

import os
import shutil
from pathlib import Path

import pytest

from tests.programs import run_program

FIRMWARE = Path(__file__).parents[2] / "firmware"


def need(*tools: str) -> None:
    """Skip what needs a tool that is not here; on a build machine that is a failure."""
    missing = [tool for tool in tools if shutil.which(tool) is None]
    if missing and not os.environ.get("CI"):
        pytest.skip(f"not installed: {', '.join(missing)}")
    assert not missing, f"not installed: {', '.join(missing)}"


def make(target: str) -> Path:
    """Bring a target of the firmware's Makefile up to date, one test process at a time.

    Returns
    -------
    Path
        Where the target is, if it is a file.
    """
    need("make", "gcc", *([] if "host" in target else ["avr-gcc"]))
    run_program("flock", FIRMWARE, "make", "-C", FIRMWARE, target, timeout=None)
    return FIRMWARE / target
