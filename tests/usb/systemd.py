"""What systemd says of a unit."""

import shutil
import subprocess
from pathlib import Path

from tests.waiting import PATIENCE_S

IS_HERE = bool(shutil.which("systemd-analyze"))


def complaints_of(unit: Path) -> list[str]:
    """Lines that name the unit."""
    done = subprocess.run(
        ["systemd-analyze", "verify", unit],
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE_S,
    )
    return [line for line in done.stderr.splitlines() if unit.name in line]
