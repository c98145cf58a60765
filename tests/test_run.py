"""``./run test``: what it takes from a shell, and that a failure is named at once."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
WAITS = """
from pathlib import Path
from tests.waiting import until
def test_fails():
    assert 1 == 2
def test_waits():
    until(Path("{}").exists)
"""


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


def test_a_test_that_fails_is_named_while_others_are_at_work(tmp_path):
    file, go = tmp_path / "test_one.py", tmp_path / "go"
    file.write_text(WAITS.format(go))
    command = [sys.executable, "-m", "pytest", "-p", "tests.conftest", "-n", "1"]
    with subprocess.Popen(
        [*command, "-c", "pyproject.toml", file], cwd=ROOT, stdout=subprocess.PIPE, text=True
    ) as process:
        lines = iter(process.stdout.readline, "")
        named = next(line for line in lines if "test_fails" in line)
        go.touch()  # only now may the other test end
        process.communicate()
    assert re.fullmatch(r"FAILED .*::test_fails: .*test_one\.py:5: assert 1 == 2\n", named)
    assert process.returncode == 1
