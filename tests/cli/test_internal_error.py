"""An exception that nobody foresaw: a short message, a log to report it with, and no traceback."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

BROKEN = """
import sys, rig.cli, rig.__main__
def broken(_):
    {}
rig.cli.import_module = {}
sys.argv[1:] = {!r}
rig.__main__.start()
"""
AT_WORK = "lambda _: type('module', (), {'main': broken})"


def ended(program, state, **options):
    return subprocess.run(
        [sys.executable, "-c", program],
        env=os.environ | {"XDG_STATE_HOME": str(state)},
        **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, **options},
        check=False,
    )


@pytest.mark.parametrize("when", [AT_WORK, "broken"], ids=["at work", "while it loads"])
def test_a_command_leaves_a_log_and_says_where(when, tmp_path):
    done = ended(BROKEN.format("1 / 0", when, ["analyze", "s", "--json"]), tmp_path)
    assert (done.returncode, done.stdout) == (1, "")
    told = r"rig: internal error \(ZeroDivisionError\); this is a bug, .* with the log at (.*)\n"
    log = Path(re.fullmatch(told, done.stderr)[1])
    assert log.parent == tmp_path / "chainrig"
    text = log.read_text("utf-8")
    assert "analyze s --json" in text
    assert sys.version.split()[0] in text
    assert "in broken" in text
    assert text.endswith("ZeroDivisionError: division by zero\n")


@pytest.mark.parametrize("home", ["/proc/1", "/dev/null"])
def test_where_no_log_can_be_written_that_is_said(home):
    done = ended(BROKEN.format("1 / 0", AT_WORK, ["check", "x"]), home)
    assert done.returncode == 1
    assert "its log could not be written: cannot make the folder" in done.stderr
    assert "Traceback" not in done.stderr


def test_the_exit_code_stays_when_nobody_reads_the_message(tmp_path, unread):
    done = ended(BROKEN.format("1 / 0", AT_WORK, ["check", "x"]), tmp_path, stderr=unread)
    assert done.returncode == 1


@pytest.mark.parametrize("when", [AT_WORK, "broken"], ids=["at work", "while it loads"])
@pytest.mark.parametrize(("ends", "code"), [("SystemExit(7)", 7), ("KeyboardInterrupt", 130)])
def test_other_ends_are_no_internal_errors(when, ends, code, tmp_path):
    done = ended(BROKEN.format(f"raise {ends}", when, ["check", "x"]), tmp_path)
    assert done.returncode == code
    assert list(tmp_path.iterdir()) == []
