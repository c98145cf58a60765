"""The command line as ``command_help.txt`` describes it: the parser, its help and its mistakes."""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections import namedtuple
from functools import cache, partial

from rig import __version__
from rig.streams import say

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any, NoReturn


class Command(namedtuple("Command", "name text arguments examples")):
    """One command, or one of two words below another.

    `arguments` are rows for `_add_argument`, `examples` whole command lines.
    """

    name: str
    text: str
    arguments: list[str]
    examples: list[str]


def _read_page() -> dict[str, list[Command]]:
    """Return the commands of each group."""
    place = f"{__file__.removesuffix('.py')}.txt"
    with open(place, encoding="utf-8") as page:  # noqa: PTH123 - pathlib takes 5 ms
        paragraphs = page.read().strip().split("\n\n")
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
            name, text = head.split(": ", 1)
            rows = [shared.get(line, line) for line in lines[: len(lines) - len(examples)]]
            commands.append(Command(name, text, rows, examples))
    return groups


GROUPS = _read_page()
"""Every command by its group, in the order in which they are met."""
COMMANDS = {command.name: command for commands in GROUPS.values() for command in commands}

_NAMED = rf"(?<![\w/.-])rig (?=(?:{'|'.join(COMMANDS)}|--help)(?![\w:-]))"
"""A command, but not the name that begins a program's own narration, as in ``rig daemon:``."""


def runnable(text: str) -> str:
    """Write each command of a text as this user can run it.

    Before anybody activates the environment of `./run demo`, that is ``.venv/bin/rig check``.
    """
    return re.sub(_NAMED, lambda _: f"{_program()} ", text)


@cache
def _program() -> str:
    from shlex import quote  # noqa: PLC0415 - only for what names a command
    from shutil import which  # noqa: PLC0415 - likewise

    installed = os.path.join(os.path.dirname(sys.executable), "rig")  # noqa: PTH118, PTH120
    if which("rig"):
        return "rig"
    if which(installed) is None:
        return f"{quote(sys.executable)} -m rig"
    here = os.path.relpath(installed)
    return quote(installed if here.startswith(os.pardir) else here)


def _join_pairs(typed: Sequence[str]) -> list[str]:
    """Make a single word of the pairs after ``--map``, whatever blanks were typed."""
    words = []
    for word in typed:
        words += word.split("=", 1) if word.startswith("--map=") else [word]
    if "--map" not in words:
        return words
    first = words.index("--map") + 1
    end = next((n for n in range(first, len(words)) if words[n].startswith("-")), len(words))
    # A file's name may follow: the pairs end with the last "=" and the channel behind it.
    signs = [n for n in range(first, end) if "=" in words[n]]
    if signs:
        last = min(end, signs[-1] + 1 + words[signs[-1]].endswith("="))
        last += words[last : last + 1] == [","]
        words[first:last] = [" ".join(words[first:last])]
    return words


class Parser(argparse.ArgumentParser):
    """A parser whose mistakes name what was meant."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**{"formatter_class": argparse.RawDescriptionHelpFormatter, **options})
        self.commands: dict[str, Parser] = {}

    def parse(self, args: Sequence[str]) -> argparse.Namespace:
        """Parse; what is left over is the mistake of the sub-command that was named."""
        words = _join_pairs(args)
        arguments, rest = self.parse_known_args(words)
        if rest:
            name = next((word for word in words if word in self.commands), "")
            self.commands.get(name, self).error(f"unknown arguments: {' '.join(rest)}")
        return arguments

    def _check_value(self, action: argparse.Action, value: object) -> None:
        if action.choices is not None and value not in action.choices:
            from difflib import get_close_matches  # noqa: PLC0415 - only a mistake needs it

            accepted = list(map(str, action.choices))
            likely = get_close_matches(str(value), accepted, n=1)
            guess = f"did you mean {likely[0]}? " if likely else ""
            message = f"found '{value}'; {guess}accepted: {', '.join(accepted)}"
            raise argparse.ArgumentError(action, message)

    def error(self, message: str) -> NoReturn:
        """Say what is wrong and where help is, and end."""
        say(runnable(f"{self.prog}: {message}\n{self.format_usage()}  hint: {self.prog} --help"))
        self.exit(2)


_WIDTH = 78
"""Characters of a line of the first help, as argparse has it on a terminal of 80."""
_MODULES = {"import": "import_edges"}
"""Modules of commands whose names are not theirs."""
_WORDS: dict[str, dict[str, Any]] = {
    "flag": {"action": "store_true"},
    "yes-no": {"action": argparse.BooleanOptionalAction},
    "append": {"action": "append"},
    "required": {"required": True},
    "either": {},
    "one-of": {},
    "?": {"nargs": "?"},
    "*": {"nargs": "*"},
    "+": {"nargs": "+"},
}
"""What the words of the page's second column mean to argparse, beside ``=DEFAULT``, ``{CHOICES}``
and kinds of values; of several with ``either`` at most one is accepted, of ``one-of`` just one."""


def _add_argument(
    parser: argparse._ActionsContainer, row: str, kinds: dict[str, dict[str, Any]]
) -> None:
    """Accept what a row of the page describes."""
    names, words, text = (part.strip() for part in row.split("|", 2))
    *flags, metavar = names.split()
    options: dict[str, Any] = {"help": text.replace("%", "%%")}
    if not flags or metavar.startswith("-"):
        flags.append(metavar)
    else:
        options["metavar"] = metavar
    for word in words.split():
        if word.startswith("="):
            options["default"] = word.removeprefix("=")
        elif word.startswith("{"):
            options["choices"] = list(map(options.get("type", str), word.strip("{}").split(",")))
        else:
            kind, _, detail = word.partition(":")
            options |= kinds[kind]
            if detail:
                options["type"] = partial(options["type"], detail)
    parser.add_argument(*flags, **options)


def _matching_commands(words: Sequence[str] | None) -> list[Command]:
    """Return the commands that words may name: that of the first one, else all, or none."""
    every = [*COMMANDS.values()]
    if words is None:
        return every
    if named := [command for command in every if command.name.split()[:1] == [*words[:1]]]:
        return named
    return every if any(not word.startswith("-") for word in words) else []


def build_parser(
    kinds: Callable[[], dict[str, dict[str, Any]]], words: Sequence[str] | None = None
) -> Parser:
    """Make the parser of all commands.

    Parameters
    ----------
    kinds
        Gives what argparse needs to know of each kind of value; not called where no command is
        made. What stands behind a kind's colon is the first argument of its ``type``.
    words
        What is to be parsed: commands that it cannot name are left out, as they take time.
    """
    lines = []
    for group, commands in GROUPS.items():
        top = (command for command in commands if " " not in command.name)
        lines += ["", f"{group}:", *(f"  {command.name:<12}{command.text}" for command in top)]
    parser = Parser(
        prog="rig",
        usage="rig [-h] [--version] COMMAND ...",
        # All its lines are short: to wrap them, argparse would load shutil and textwrap.
        formatter_class=partial(argparse.RawTextHelpFormatter, width=_WIDTH),
        description="Lab-rig controller for falling-chain and photogate experiments.",
        epilog="\n".join(lines) + "\n\n"
        "Exit codes: 0 done, 1 internal error (with a log), 2 bad input, 3 a run was\n"
        "void, 4 device trouble, 130 interrupted. rig replay: 1 the results differ.",
    )
    parser.add_argument("--version", action="version", version=f"rig {__version__}")
    below = {"": parser.add_subparsers(prog="rig", metavar="COMMAND", help=argparse.SUPPRESS)}
    parsers = parser.commands
    for command in _matching_commands(words):
        name = command.name
        outer, _, last = name.rpartition(" ")
        if outer not in below:
            below[outer] = parsers[outer].add_subparsers(required=True, metavar=outer.upper())
        examples = "\n  ".join(["examples:", *command.examples]) if command.examples else None
        options: dict[str, Any] = {"help": command.text} if outer else {}
        parsers[name] = below[outer].add_parser(
            last, description=command.text, epilog=examples, **options
        )
        parsers[name].set_defaults(module=_MODULES.get(name, name.replace(" ", "_")))
        either = None
        for row in command.arguments:
            alone = {"either", "one-of"} & set(row.split("|")[1].split())
            if alone:
                needed = "one-of" in alone
                either = either or parsers[name].add_mutually_exclusive_group(required=needed)
            _add_argument(either if either and alone else parsers[name], row, _WORDS | kinds())
    return parser
