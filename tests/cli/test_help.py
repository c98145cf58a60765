"""What the command line says of itself, to people and to shells, and of what it does not accept."""

import os
import re
import shlex
import shutil
import sys
from pathlib import Path

import pytest

from rig.boards import BOARDS
from rig.cli import BAD_INPUT, INTERRUPTED, _parser
from rig.command_page import COMMANDS
from rig.commands.output import VOID
from rig.commands.replay import DIFFERENT
from rig.errors import DeviceError, InputError, RigError
from rig.flash.boards import TARGETS
from tests.programs import run_program
from tests.refusals import refused
from tests.tables import cases


def commands():
    return next(one.choices for one in _parser()._actions if one.dest != "help" and one.choices)


def test_every_command_has_a_group_and_two_examples(call):
    known = commands()
    assert [name for name in COMMANDS if " " not in name] == list(known)
    done = call(code=2)
    assert done.out == ""
    for name in known:
        assert f"\n  {name} " in done.err
        assert len(COMMANDS[name].examples) >= 2
        assert COMMANDS[name].text in done.err


def test_a_command_is_parsed_without_the_others():
    whole = _parser()
    for name in COMMANDS:
        alone = _parser([*name.split(), "--help"])
        assert {each.split()[0] for each in alone.commands} == {name.split()[0]}
        assert alone.commands[name].format_help() == whole.commands[name].format_help()
    assert _parser(["--help"]).format_help() == whole.format_help()


@pytest.mark.parametrize("words", [["bogus", "run"], ["--foo", "run"], ["", "run"], ["--", "runs"]])
def test_what_is_no_command_is_refused_by_all_that_there_are(words, capsys):
    refused(SystemExit, "", _parser(words).parse, words)
    refused(SystemExit, "", _parser().parse, words)
    said = capsys.readouterr().err
    assert said[: len(said) // 2] == said[len(said) // 2 :]


def test_each_board_is_a_choice():
    def choices(command):
        return next(a.choices for a in commands()[command]._actions if a.dest == "board")

    assert choices("check") == list(BOARDS)
    assert choices("new") == [*BOARDS, "other"]
    assert choices("flash") == list(TARGETS)


def test_every_exit_code_is_listed():
    text = "Exit codes: " + _parser().format_help().partition("Exit codes: ")[2]
    known = {kind.exit_code for kind in (RigError, InputError, DeviceError)}
    known |= {0, BAD_INPUT, INTERRUPTED, VOID, DIFFERENT}
    assert {int(code) for code in re.findall(r"\b\d+(?= [a-z])", text)} == known
    assert "rig replay: 1" in text
    assert max(map(len, text.splitlines())) <= 80


EXAMPLES = [line for command in COMMANDS.values() for line in command.examples]


@pytest.mark.parametrize("line", EXAMPLES)
def test_examples_are_commands(line):
    for part in line.split(" && "):
        program, *words = shlex.split(part)
        assert program == "rig"
        assert _parser().parse(words).place


@cases
def test_a_mistake_is_named_and_nothing_is_written(
    call, words, said, finished, tmp_path, monkeypatch
):
    finished.copy(tmp_path)
    (tmp_path / "there.yaml").write_text("just words\n", "utf-8")
    (tmp_path / "edges.csv").write_text("run,channel,time_s,state\n1,0,0.1,1\n", "utf-8")
    monkeypatch.chdir(tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    done = call(*words, code=4 if said.startswith("cannot open") else 2)
    assert (done.out, said in done.err) == ("", True), done
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


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
