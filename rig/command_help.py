"""The command line as ``command_help.txt`` describes it: the parser, its help and its mistakes."""

import argparse
from collections.abc import Sequence
from functools import partial
from typing import Any, NoReturn

from rig import __version__
from rig.command_page import COMMANDS, first_help
from rig.streams import say


def _join_pairs(typed: Sequence[str]) -> list[str]:
    """Make a single word of the pairs after ``--map``, whatever blanks were typed."""
    words = []
    for word in typed:
        words += word.split("=", 1) if word.startswith("--map=") else [word]
    first = words.index("--map") + 1 if "--map" in words else len(words)
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
        self.labels: dict[str, str] = {}
        self.rules: list[tuple[str, str, str]] = []

    def parse(self, args: Sequence[str]) -> argparse.Namespace:
        """Parse; what is left over or in wrong company is the mistake of the sub-command."""
        arguments, rest = self.parse_known_args(_join_pairs(args))
        command = self.commands.get(vars(arguments).get("command", ""), self)
        if rest:
            command.error(f"unknown arguments: {' '.join(rest)}")
        command._check_company(arguments)
        return arguments

    def _check_company(self, arguments: argparse.Namespace) -> None:
        """Refuse an argument that another one makes useless, or that is useless without another."""
        given = {
            name
            for name, value in vars(arguments).items()
            if name in self.labels and value != [] and value != self.get_default(name)
        }
        for name, rule, other in self.rules:
            if name in given and (other in given) == (rule == "without"):
                verb = "needs" if rule == "with" else "is of no use beside"
                self.error(f"{self.labels[name]} {verb} {self.labels[other]}")

    def format_help(self) -> str:
        """Return the help of a command, or the first help."""
        return super().format_help() if self.prog != "rig" else first_help()

    def _check_value(self, action: argparse.Action, value: object) -> None:
        if action.choices is not None and value not in action.choices:
            from rig.units import did_you_mean  # noqa: PLC0415 - only a mistake needs it

            accepted = list(map(str, action.choices))
            guess = did_you_mean(str(value), accepted)
            raise argparse.ArgumentError(
                action, f"found '{value}'; {guess}accepted: {', '.join(accepted)}"
            )

    def error(self, message: str) -> NoReturn:
        """Say what is wrong and where help is, and end."""
        say(f"{self.prog}: {message}\n{self.format_usage()}  hint: {self.prog} --help")
        self.exit(2)


_WORDS: dict[str, dict[str, Any]] = {
    "flag": {"action": "store_true"},
    "yes-no": {"action": argparse.BooleanOptionalAction},
    "append": {"action": "append"},
    "required": {"required": True},
}
"""What the words of the page's second column mean to argparse, beside ``=DEFAULT``, ``{CHOICES}``,
how often it stands (``?``, ``*`` or ``+``) and kinds of values; of several with ``either`` at most
one is accepted, of ``one-of`` just one. ``with:NAME`` and ``without:NAME`` say what an argument has
no use without, and beside what."""


def _add_argument(parser: Parser, row: str, kinds: dict[str, dict[str, Any]]) -> None:
    """Accept what a row of the page describes."""
    names, words, text = (part.strip() for part in row.split("|", 2))
    *flags, metavar = names.split()
    options: dict[str, Any] = {"help": text.replace("%", "%%")}
    if not flags or metavar.startswith("-"):
        flags.append(metavar)
    else:
        options["metavar"] = metavar
    name = flags[-1].strip("-").replace("-", "_")
    place: argparse._ActionsContainer = parser
    for word in words.split():
        kind, _, detail = word.partition(":")
        if word.startswith("="):
            options["default"] = word.removeprefix("=")
        elif word.startswith("{"):
            accepted = word.strip("{}").split(",")
            options |= {"choices": [*map(_number, accepted)], "type": _number}
        elif word in {"?", "*", "+"}:
            options["nargs"] = word
        elif kind in {"with", "without"}:
            parser.rules += [(name, kind, other) for other in detail.split(",")]
        elif kind in {"either", "one-of"}:
            if not parser._mutually_exclusive_groups:
                parser.add_mutually_exclusive_group(required=kind == "one-of")
            (place,) = parser._mutually_exclusive_groups
        else:
            options |= kinds[kind]
            if detail:
                options["type"] = partial(options["type"], detail)
    place.add_argument(*flags, **options)
    label = metavar if metavar.lower() == name else names
    parser.labels[name] = flags[-1] if flags[-1].startswith("-") else label


def _number(text: str) -> int | str:
    """Return a choice as the number that it is; any other text is no such choice."""
    return int(text) if text.isdecimal() else text


def build_parser(kinds: dict[str, dict[str, Any]], words: Sequence[str] = ()) -> Parser:
    """Make the parser of all commands.

    Parameters
    ----------
    kinds
        What argparse needs to know of each kind of value. What stands behind a kind's colon is the
        first argument of its ``type``.
    words
        What is to be parsed. If the first word names commands, all others are left out, as they
        take time.
    """
    parser = Parser(prog="rig", usage="rig [-h] [--version] COMMAND ...")
    parser.add_argument("--version", action="version", version=f"rig {__version__}")
    below = {"": parser.add_subparsers(prog="rig", metavar="COMMAND")}
    parsers = parser.commands
    named = [row for row in COMMANDS.values() if row.name.split()[:1] == [*words[:1]]]
    for command in named or COMMANDS.values():
        name = command.name
        outer, _, last = name.rpartition(" ")
        if outer not in below:
            below[outer] = parsers[outer].add_subparsers(required=True, metavar=outer.upper())
        examples = "\n  ".join(["examples:", *command.examples]) if command.examples else None
        options: dict[str, Any] = {"help": command.text} if outer else {}
        parsers[name] = below[outer].add_parser(
            last, description=command.text, epilog=examples, **options
        )
        parsers[name].set_defaults(place=command.place, command=name)
        for row in command.arguments:
            _add_argument(parsers[name], row, _WORDS | kinds)
    return parser
