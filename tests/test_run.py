"""``./run test``: what it takes from a shell, and that a failure is named at once."""

import os
import re
from pathlib import Path

from bench.__main__ import BENCHES
from tests.programs import run_program

ROOT = Path(__file__).parents[1]


def function(name: str) -> str:
    text = (ROOT / "run").read_text()
    return re.findall(rf"^{name}\(\) \{{\n(?:.*\n)*?\}}$", text, re.MULTILINE)[0]


def test_tests_get_what_any_shell_has_and_what_installers_need():
    kept = {"PATH": os.environ["PATH"], "LANG": "C.UTF-8", "PIP_CERT": "a b", "https_proxy": "c"}
    lost = {"PYTHONUNBUFFERED": "1", "PYTEST_ADDOPTS": "-x", "RIG_PORT": "sim://"}
    script = f"set -euo pipefail\n{function('bare')}\nbare env"
    done = run_program("bash", "-c", script, env=kept | lost)
    assert dict(line.split("=", 1) for line in done.stdout.splitlines()) == kept


def test_every_bench_is_sent_to_where_it_is(tmp_path):
    for name in ("rig", "python"):
        (tmp_path / name).symlink_to("/bin/echo")
    wanted = {name: f"-m bench {name}" for name in BENCHES}
    wanted |= {name: f"bench {name}" for name in ("precision", "scenes", "stability")}
    calls = "".join(f"\none_bench {name}" for name in wanted)
    script = f"say() {{ :; }}\nbin={tmp_path}\n{function('one_bench')}{calls}"
    assert run_program("bash", "-c", script).stdout.splitlines() == [*wanted.values()]
