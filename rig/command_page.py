"""What ``command_help.txt`` says of the commands, and the first help, as quick as Python itself."""

from typing import NamedTuple

from rig import __version__
from rig.text_rows import read_paragraphs, read_text


class Command(NamedTuple):
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


def _read_page() -> dict[str, list[Command]]:
    """Return the commands of each group."""
    groups: dict[str, list[Command]] = {}
    shared: dict[str, str] = {}
    for head, *lines in read_paragraphs(__file__, "command_help.txt"):
        if head == "shared":
            shared = {line.partition(" |")[0]: line for line in lines}
        elif head.startswith("= "):
            groups[head.removeprefix("= ")] = commands = []
        else:
            examples = [line.strip(" $") for line in lines if line.startswith("  $ ")]
            heading, text = head.split(": ", 1)
            name, _, place = heading.partition(" = ")
            place = place or f"{name.replace(' ', '_')}.main"
            rows = [shared.get(line, line) for line in lines if not line.startswith("  $ ")]
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
    return read_text(__file__, "first_help.txt").replace("{commands}", "\n".join(lines))


def first_answer(words: list[str]) -> str:
    """Return what answers a command line that names no command; empty for any other."""
    if words in (["-h"], ["--help"]):
        return first_help()
    return f"rig {__version__}\n" if words == ["--version"] else ""
