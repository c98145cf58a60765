"""The unit that is shipped for systemd."""

import configparser
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from rig.cli import _parser
from rig.usb.listing import KNOWN
from tests.waiting import PATIENCE_S

ROOT = Path(__file__).parents[2]
UNIT = ROOT / "packaging" / "chainrig.service"


def test_it_starts_a_command_that_there_is():
    unit = configparser.ConfigParser(interpolation=None)
    unit.optionxform = str
    unit.read(UNIT)
    words = unit["Service"]["ExecStart"].split()
    rig = words.index("rig")
    arguments = [word for word in words[rig + 1 :] if word != "$RIG_OPTIONS"]
    assert _parser().parse_args(arguments).module == "daemon"


@pytest.mark.parametrize("name", sorted({kind.name for kind in KNOWN if kind.board}))
def test_the_port_that_the_page_writes_into_its_settings_is_that_of_any_board(name, tmp_path):
    (line,) = re.findall(
        r'^echo "(RIG_PORT=.*)" >', (ROOT / "docs/daemon.md").read_text(), re.MULTILINE
    )
    for device in (name.replace(" ", "_"), "Generic_Modem"):
        (tmp_path / f"usb-{device}_0042-if00").touch()
    said = line.replace("/dev/serial/by-id", str(tmp_path))
    done = subprocess.run(
        ["sh", "-c", f'echo "{said}"'], capture_output=True, text=True, check=True
    )
    assert done.stdout == f"RIG_PORT={tmp_path}/usb-{name.replace(' ', '_')}_0042-if00\n"


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
