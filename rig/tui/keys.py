"""The operator's own keys, from a small file with lines such as ``reject = "r"``."""

import os
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path

from textual.keys import Keys, key_to_character

from rig.errors import InputError
from rig.files import read_input
from rig.reasons import errors_become, rig_error
from rig.tui.actions import ACTIONS, BY_NAME

ALWAYS = {"stop": "f9", "go_on": "enter"}
"""Keys that an action keeps in addition to the operator's own."""
_HELD = {"ctrl", "shift", "alt"}


def read_keys(path: Path | None = None) -> dict[str, str]:
    """Return the keys of every action, by name.

    Parameters
    ----------
    path
        The file; by default that of the user's configuration, which need not exist.

    Raises
    ------
    InputError
        With every problem: unknown actions, keys given twice, no TOML.
    """
    base = os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    place = path or Path(base) / "chainrig" / "keys.toml"
    if path is None and not place.is_file():
        return {action.name: action.keys for action in ACTIONS}
    with errors_become("keys_unreadable", OSError, ValueError, path=place):
        text = read_input(place).decode()
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        reason, _, at = str(error).partition(" (at ")
        *before, last = text.split("\n")
        line, column = re.findall(r"\d+", at) or (len(before) + 1, len(last) + 1)
        where = f"{place}:{line}:{column}"
        raise rig_error("keys_unreadable", path=where, text=reason) from None
    lines = {line.partition("=")[0].strip(): n for n, line in enumerate(text.splitlines(), start=1)}
    return merge_keys(table, str(place), lines)


def merge_keys(
    table: Mapping[str, object], source: str, lines: Mapping[str, int] | None = None
) -> dict[str, str]:
    """Return the table's keys with the operator's keys in their place.

    A key that the operator gives to an action is removed from the action that had it.

    Parameters
    ----------
    table
        Keys by action.
    source
        Name of the source, for messages.
    lines
        Line of each action in the source.

    Raises
    ------
    InputError
        With every problem.
    """
    faults: list[str] = []
    given: dict[str, list[str]] = {}
    owner = {key: name for name, key in ALWAYS.items()}
    for name, value in table.items():
        at = f"{source}:{(lines or {})[name]}" if lines else source
        if name not in BY_NAME:
            faults.append(f"{at}: unknown action {name}; accepted: {', '.join(BY_NAME)}")
            continue
        keys = [key.strip() for key in str(value).split(",") if key.strip()]
        if not isinstance(value, str) or not keys:
            faults.append(f'{at}: {name}: give a key or several, such as "r" or "r,f5"')
            continue
        given[name] = [*keys, *{ALWAYS.get(name, keys[0])}.difference(keys)]
        for key in given[name]:
            if key == "escape":
                faults.append(f"{at}: {name}: {key} always means STOP")
            elif not _is_key(key):
                examples = "r, f5, ctrl+r, enter, question_mark"
                faults.append(f"{at}: {name}: unknown key {key}; examples: {examples}")
            elif owner.setdefault(key, name) != name:
                faults.append(f"{at}: {name}: {key} already belongs to {owner[key]}")
    for action in ACTIONS:
        own = [key for key in action.keys.split(",") if owner.get(key, action.name) == action.name]
        if not given.setdefault(action.name, own):
            faults.append(f"{source}: {action.name} has no key left; give it a key")
    if faults:
        raise InputError("\n".join(faults))
    return {action.name: ",".join(given[action.name]) for action in ACTIONS}


def _is_key(key: str) -> bool:
    """Whether a terminal may send a key, by Textual's names."""
    *held, last = key.split("+")
    is_named = last in {name.value for name in Keys} or key_to_character(last) is not None
    # Of single characters only letters and digits: others have names, such as question_mark.
    return set(held) <= _HELD and (last.isalnum() if len(last) == 1 else is_named)
