"""The simulation as others install it: under a name of its own, found by its URL."""

import os
import sys
import tomllib
from pathlib import Path
from shutil import copytree

from tests.programs import run_program

ROOT = Path(__file__).parents[2]
WHEEL = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["hatch"]["build"][
    "targets"
]["wheel"]
DROP = """
import rig, sys
from rig.link.port import open_port
open_port("sim://?protocol=" + sys.argv[1]).close()
print(rig.__file__, *sorted({name.partition(".")[0] for name in sys.modules} & {"sim", "rig_sim"}))
"""


def test_an_installed_simulation_leaves_the_name_sim_to_others(tmp_path):
    for source in WHEEL["packages"]:
        copytree(ROOT / source, tmp_path / WHEEL["sources"].get(source, source))
    (tmp_path / "sim.py").write_text("raise SystemExit('this is another package')\n")
    protocol = ROOT / "protocols/falling-ball.yaml"
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = run_program(sys.executable, "-c", DROP, protocol, cwd=tmp_path, env=environment)
    assert done.stdout.split() == [str(tmp_path / "rig/__init__.py"), "rig_sim"], done.stderr
