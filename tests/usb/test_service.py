"""The unit that is shipped for systemd."""

from __future__ import annotations

import configparser
import shutil
import subprocess
from pathlib import Path

import pytest

from rig.cli import _parser
from tests.waiting import PATIENCE_S

UNIT = Path(__file__).parents[2] / "packaging" / "chainrig.service"


def test_it_starts_a_command_that_there_is():
    unit = configparser.ConfigParser(interpolation=None)
    unit.optionxform = str
    unit.read(UNIT)
    words = unit["Service"]["ExecStart"].split()
    rig = words.index("rig")
    arguments = [word for word in words[rig + 1 :] if word != "$RIG_OPTIONS"]
    assert _parser().parse_args(arguments).module == "daemon"


@pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="needs systemd-analyze")
def test_systemd_understands_it():
    done = subprocess.run(
        ["systemd-analyze", "verify", UNIT],
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE_S,
    )
    complaints = [line for line in done.stderr.splitlines() if UNIT.name in line]
    assert complaints == []
