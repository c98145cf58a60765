"""A command that needs a package which is no plain dependency names it, without a traceback."""

import sys

from tests.programs import run_program

WITHOUT_MPMATH = """
import sys
sys.modules["mpmath"], sys.executable = None, "/a lab/bin/python"
from rig import cli
sys.exit(cli.main(["bench", "stability"]))
"""


def test_a_missing_package_is_named_with_a_command_that_brings_it():
    """In a process of its own: modules loaded a second time would stay behind for other tests."""
    done = run_program(sys.executable, "-c", WITHOUT_MPMATH, code=None)
    wanted = "rig: this needs mpmath: '/a lab/bin/python' -m pip install mpmath\n"
    assert (done.returncode, done.stderr) == (2, wanted)
