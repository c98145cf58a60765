"""``./run test``: what it takes from a shell, and that a failure is named at once."""

import os
import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_tests_get_what_any_shell_has_and_what_installers_need():
    (function,) = re.findall(
        r"^bare\(\) \{\n(?:.*\n)*?\}$", (ROOT / "run").read_text(), re.MULTILINE
    )
    kept = {"PATH": os.environ["PATH"], "LANG": "C.UTF-8", "PIP_CERT": "a b", "https_proxy": "c"}
    lost = {"PYTHONUNBUFFERED": "1", "PYTEST_ADDOPTS": "-x", "RIG_PORT": "sim://"}
    script = f"set -euo pipefail\n{function}\nbare env"
    done = subprocess.run(
        ["bash", "-c", script], env=kept | lost, capture_output=True, text=True, check=True
    )
    assert dict(line.split("=", 1) for line in done.stdout.splitlines()) == kept
