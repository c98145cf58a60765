"""What ``command_help.txt`` says of the commands, and the first help, as quick as Python itself."""

from __future__ import annotations

from collections import namedtuple

from rig import __version__


# Of collections, for typing takes a third as long to load as Python.
class Command(namedtuple("Command", "name place text arguments examples")):
    """One command, or one of two words below another.

    Attributes
    ----------
    name, place, text
        Its words, the module and function of `rig.commands` that carry it out, and what it does.
    arguments
        Rows for `rig.command_help`.
    examples
        Whole command lines.
    """

    name: str
    place: str
    text: str
    arguments: list[str]
    examples: list[str]


def _read_text(name: str) -> str:
    place = __file__.replace("command_page.py", name)
    with open(place, encoding="utf-8") as file:  # noqa: PTH123 - pathlib takes 5 ms
        return file.read()


def _read_page() -> dict[str, list[Command]]:
    """Return the commands of each group."""
    paragraphs = _read_text("command_help.txt").strip().split("\n\n")
    groups: dict[str, list[Command]] = {}
    shared: dict[str, str] = {}
    for paragraph in paragraphs:
        head, *lines = paragraph.splitlines()
        if head == "shared":
            shared = {line.partition(" |")[0]: line for line in lines}
        elif head.startswith("## "):
            groups[head.removeprefix("## ")] = commands = []
        elif not head.startswith("#"):
            examples = [line.strip(" $") for line in lines if line.startswith("  $ ")]
            heading, text = head.split(": ", 1)
            name, _, place = heading.partition(" = ")
            place = place or f"{name.replace(' ', '_')}.main"
            rows = [shared.get(line, line) for line in lines[: len(lines) - len(examples)]]
            commands.append(Command(name, place, text, rows, examples))
    return groups


GROUPS = _read_page()
"""Every command by its group, in the order in which they are met."""
COMMANDS = {command.name: command for commands in GROUPS.values() for command in commands}


def first_help() -> str:
    """Return what ``rig --help`` prints."""
    lines = []
    for group, commands in GROUPS.items():
        top = (command for command in commands if " " not in command.name)
        lines += ["", f"{group}:", *(f"  {command.name:<12}{command.text}" for command in top)]
    return _read_text("first_help.txt").replace("{commands}", "\n".join(lines))


def first_answer(words: list[str]) -> str:
    """Return what answers a command line that names no command; empty for any other."""
    if words in (["-h"], ["--help"]):
        return first_help()
    return f"rig {__version__}\n" if words == ["--version"] else ""
