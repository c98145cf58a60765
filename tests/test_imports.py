"""A command loads what it needs and no more: a fresh interpreter tells what it loaded."""

import ast
import json
import re
import sys
import tomllib
from pathlib import Path

from rig.cli import OPTIONAL
from rig.flash.boards import TARGETS
from rig.ready import ready_protocol
from tests.programs import run_program
from tests.tables import cases

ROOT = Path(__file__).parents[1]
LAST_LINE = """
import json, sys
print()
print(json.dumps(sorted(sys.modules)))
"""
HEADLESS_RUN = """
import sys
import rig.cli
code = rig.cli.main(["run", "protocols/picket-fence.yaml", "--port", "sim://", "--seed", "1",
                     "--yes", "--session", sys.argv[1]])
assert code in (0, 3), code
"""


def packages_loaded_by(program: str, *arguments: str) -> set[str]:
    """Run `program` in an interpreter of its own and name the modules it loaded."""
    done = run_program(sys.executable, "-c", program + LAST_LINE, *arguments, cwd=ROOT)
    return set(json.loads(done.stdout.splitlines()[-1]))


@cases
def test_a_program_loads_nothing_that_it_does_not_need(program, absent):
    assert packages_loaded_by(program).isdisjoint(absent.split())


def test_the_analysis_loads_scipy_only_when_it_is_used():
    rooms = "import sys, rig.analysis.session, rig.estimate.session, rig.design.search"
    unused = "assert 'scipy' not in sys.modules"
    used = "from rig.analysis.distributions import coverage_factor; coverage_factor(3.0)"
    assert "scipy" in packages_loaded_by("\n".join([rooms, unused, used]))


def test_a_headless_run_loads_neither_textual_nor_matplotlib(tmp_path):
    session = tmp_path / "fence.session"
    loaded = packages_loaded_by(HEADLESS_RUN, str(session))
    assert session.is_file()
    assert loaded.isdisjoint({"matplotlib", "textual"})


def imported(path: Path) -> set[str]:
    """Name the top-level packages of all imports in a file, wherever in it they are."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found |= {one.name for one in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module)
    return {name.partition(".")[0] for name in found}


def test_all_that_a_session_needs_is_a_plain_dependency():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    named = {re.match(r"[\w-]+", one).group().lower() for one in project["dependencies"]}
    packages = {"pyserial": "serial", "pyyaml": "yaml"}
    known = {packages.get(name, name) for name in named} | sys.stdlib_module_names
    known |= {"rig", "sim", "rich", "markupsafe"}  # these come with Textual and Jinja2
    files = [path for room in ("rig", "sim") for path in ROOT.glob(f"{room}/**/*.py")]
    assert set().union(*map(imported, files)) - known == set(OPTIONAL)


def test_a_wheel_has_the_files_that_commands_look_for():
    hatch = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["hatch"]
    shipped = hatch["build"]["targets"]["wheel"]["force-include"]
    assert all((ROOT / source).exists() for source in shipped)
    looked_for = [
        ready_protocol("inclined-uniform"),
        *(board.wiring_path for board in TARGETS.values()),
    ]
    for path in (one.relative_to(ROOT) for one in looked_for):
        source = next(one for one in (path, *path.parents) if str(one) in shipped)
        assert shipped[str(source)] == f"rig/{source}"
