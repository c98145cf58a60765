"""Help of the command line: commands in groups, two examples each, spelling, the program's name."""

from __future__ import annotations

import argparse
import os
import re
import sys
from functools import cache
from typing import TYPE_CHECKING, Any, NoReturn

from rig.streams import say

if TYPE_CHECKING:
    from collections.abc import Sequence

GROUPS: dict[str, tuple[str, ...]] = {
    "The first minutes": ("demo", "new"),
    "Before a session": ("check", "predict", "design", "sweep"),
    "The board": ("ports", "flash", "selftest", "doctor"),
    "A session": ("run", "tui", "daemon", "import"),
    "Results": (
        "analyze",
        "compare",
        "report",
        "estimate",
        "export",
        "unblind",
        "replay",
        "recover",
    ),
    "Studies of the program itself": ("bench",),
    "The shell": ("completion",),
}
"""Every command, in the order in which they are met."""

EXAMPLES: dict[str, tuple[str, ...]] = {
    "new": ("rig new my-ball.yaml",
            'rig new my-chains.yaml --scene two-chains --board mega --gates 8 --yes'),
    "demo": ("rig demo", "rig demo --repeats 12 -o my-demo"),
    "check": ("rig check protocols/inclined-uniform.yaml", "rig check --keys"),
    "predict": ("rig predict protocols/graded-chain.yaml", "rig predict --figure 3 -o figure.svg"),
    "design": (
        "rig design protocols/inclined-uniform.yaml",
        "rig design protocols/inclined-uniform.yaml --repeats 4",
    ),
    "sweep": (
        "rig sweep protocols/single-chain.yaml --vary friction=0..0.4:50 -o sweep.svg",
        "rig sweep protocols/inclined-uniform.yaml --vary drop=100mm..300mm:20 -o sweep.csv",
    ),
    "ports": ("rig ports", "rig ports --json"),
    "flash": ("rig flash --board mega --port /dev/ttyACM0", "rig flash --board pico"),
    "selftest": ("rig selftest --port /dev/ttyACM0", "rig selftest --port sim:// --release"),
    "doctor": ("rig doctor", "rig doctor --port /dev/ttyACM0 --session my.session"),
    "run": (
        "rig run protocols/single-chain.yaml --port sim:// --session my.session",
        "rig run my-chains.yaml --port /dev/ttyACM0 --session my.session --yes",
    ),
    "tui": (
        "rig tui protocols/inclined-uniform.yaml --port sim:// --session my.session",
        "rig tui --session my.session",
    ),
    "daemon": ("rig daemon --port /dev/ttyACM0", "rig daemon --port sim:// --tcp"),
    "import": (
        "rig import edges.csv --protocol my-chains.yaml --session my.session",
        "rig import logger.txt --protocol my-chains.yaml --dry-run",
    ),
    "analyze": ("rig analyze my.session", "rig analyze my.session --budget 1"),
    "compare": ("rig compare before.session after.session",
                "rig compare group-1.session group-2.session -o groups.html"),
    "report": ("rig report my.session -o report.html",
               "rig report my.session -o report.html --figures my-figures"),
    "estimate": ("rig estimate my.session", "rig estimate my.session -o my-pictures"),
    "export": ("rig export my.session --csv my-csv",
               "rig export my.session --csv /tmp/for-a-spreadsheet"),
    "unblind": ("rig unblind my.session", "rig unblind my.session && rig analyze my.session"),
    "replay": ("rig replay my.session", "rig replay old.session"),
    "recover": ("rig recover my.session", "rig recover my.session -o saved.session"),
    "completion": ("rig completion bash", "rig completion fish"),
    "bench": ("rig bench stability", "rig bench scenes -o my-folder"),
}  # fmt: skip


_COMMANDS = "|".join(sum(GROUPS.values(), ()))
_NAMED = re.compile(rf"(?<![\w/.-])rig (?=(?:{_COMMANDS}|--help)(?![\w:-]))")
"""A command, but not the name that begins a program's own narration, as in ``rig daemon:``."""


def runnable(text: str) -> str:
    """Write each command of a text as this user can run it.

    Before anybody activates the environment of `./run demo`, that is ``.venv/bin/rig check``.
    """
    return _NAMED.sub(lambda _: f"{_program()} ", text)


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
    words = [part for word in typed for part in re.split(r"(?<=^--map)=", word, maxsplit=1)]
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
    """A parser whose mistakes name what was meant, and whose help has groups and examples."""

    def __init__(self, **options: Any) -> None:
        options.setdefault("formatter_class", argparse.RawDescriptionHelpFormatter)
        super().__init__(**options)
        examples = EXAMPLES.get(self.prog.removeprefix("rig "))
        if examples:
            self.epilog = "\n  ".join(["examples:", *examples])

    def flag(self, name: str, text: str) -> None:
        """Accept an option that is there or not."""
        self.add_argument(name, action="store_true", help=text)

    def value(self, names: str, metavar: str, text: str, **kind: Any) -> None:
        """Accept an option or an argument with a value; `kind` is as argparse takes it."""
        self.add_argument(*names.split(), metavar=metavar, help=text, **kind)

    def parse(self, args: Sequence[str] | None) -> argparse.Namespace:
        """Parse; what is left over is the mistake of the sub-command that was named."""
        words = _join_pairs(sys.argv[1:] if args is None else args)
        arguments, rest = self.parse_known_args(words)
        if rest:
            inner = next((parser for word in words if (parser := self._inner(word))), None)
            (inner or self).error(f"unknown arguments: {' '.join(rest)}")
        return arguments

    def _inner(self, word: str) -> argparse.ArgumentParser | None:
        for action in self._actions:
            if isinstance(action, argparse._SubParsersAction) and word in action.choices:
                inner: argparse.ArgumentParser = action.choices[word]
                return inner
        return None

    def _check_value(self, action: argparse.Action, value: object) -> None:
        if action.choices is not None and value not in action.choices:
            from difflib import get_close_matches  # noqa: PLC0415 - only a mistake needs it

            known = list(map(str, action.choices))
            near = get_close_matches(str(value), known, n=1)
            guess = f"did you mean {near[0]}? " if near else ""
            message = f"found '{value}'; {guess}accepted: {', '.join(known)}"
            raise argparse.ArgumentError(action, message)

    def error(self, message: str) -> NoReturn:
        """Say what is wrong and where help is, and end."""
        say(runnable(f"{self.prog}: {message}\n{self.format_usage()}  hint: {self.prog} --help"))
        self.exit(2)


def overview(texts: dict[str, str]) -> str:
    """All commands with what they do, in groups.

    Parameters
    ----------
    texts
        One line on each command.
    """
    lines = []
    for group, names in GROUPS.items():
        lines += ["", f"{group}:", *(f"  {name:<12}{texts[name]}" for name in names)]
    return "\n".join(lines)
