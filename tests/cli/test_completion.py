"""A shell completes what is typed."""

import os
import shutil
import sys
from pathlib import Path

import pytest

from rig.command_page import COMMANDS
from tests.programs import run_program


def completed(tmp_path, line):
    """Ask as the shells' functions do."""
    answer = tmp_path / "answer"
    asked = {
        "_ARGCOMPLETE": "1", "_ARGCOMPLETE_IFS": "\n", "COMP_LINE": line,
        "COMP_POINT": str(len(line)), "_ARGCOMPLETE_STDOUT_FILENAME": str(answer),
    }  # fmt: skip
    run_program(sys.executable, "-m", "rig", env=os.environ | asked)
    return {word.strip() for word in answer.read_text("utf-8").splitlines()}


def test_commands_options_choices_and_files_are_completed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.yaml").touch()
    every = {name for name in COMMANDS if " " not in name}
    assert every <= completed(tmp_path, "rig ")
    assert completed(tmp_path, "rig analyze my.session --bud") == {"--budget"}
    assert completed(tmp_path, "rig report my.session --bars half") == {"half-SD"}
    assert completed(tmp_path, "rig check min") == {"mine.yaml"}


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
def test_bash_reads_what_is_printed(tmp_path):
    script = """
    eval "$(rig completion bash)"
    COMP_WORDS=(rig ana) COMP_CWORD=1 COMP_LINE="rig ana" COMP_POINT=7
    _python_argcomplete rig ana rig
    echo "${COMPREPLY[@]}"
    """
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    done = run_program("bash", "-c", script, env=os.environ | {"PATH": path}, cwd=tmp_path)
    assert done.stdout.split() == ["analyze"]
