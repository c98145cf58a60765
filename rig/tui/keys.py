"""The operator's own keys, from a small file: ``reject = "r"`` a line."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import InputError
from rig.tui.actions import ACTIONS, BY_NAME

if TYPE_CHECKING:
    from collections.abc import Mapping

STOP_KEY = "f9"
RESERVED = ("escape",)
"""Keys whose meaning is fixed."""


def default_file() -> Path:
    """Where the file is looked for."""
    base = os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(base) / "chainrig" / "keys.toml"


def read_keys(path: Path | None = None) -> dict[str, str]:
    """Read the keys of every action, by name.

    Parameters
    ----------
    path
        The file; by default `default_file`, which need not exist.

    Raises
    ------
    InputError
        With every problem: unknown actions, keys given twice, no TOML.
    """
    place = path or default_file()
    if path is None and not place.is_file():
        return {action.name: action.keys for action in ACTIONS}
    try:
        given = tomllib.loads(place.read_text("utf-8"))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{place}: {reason}", 'one line an action: reject = "r"') from None
    return combined(given, str(place))


def combined(given: Mapping[str, object], source: str) -> dict[str, str]:
    """Put given keys over the table's own.

    A key that is given to one action is taken from the action that had it in the table.
    """
    faults = []
    chosen: dict[str, list[str]] = {}
    owner: dict[str, str] = {STOP_KEY: "stop"}
    for name, value in given.items():
        if name not in BY_NAME:
            faults.append(f"{source}: {name}: no such action; there are {', '.join(BY_NAME)}")
            continue
        if not isinstance(value, str) or not value.strip():
            faults.append(f'{source}: {name}: a key or several, as in "r" or "r,f5"')
            continue
        keys = [key.strip() for key in value.split(",") if key.strip()]
        if name == "stop" and STOP_KEY not in keys:
            keys.append(STOP_KEY)  # whoever knows only one key knows this one
        for key in keys:
            if key in RESERVED:
                faults.append(f"{source}: {name}: {key} always means STOP")
            elif owner.setdefault(key, name) != name:
                faults.append(f"{source}: {name}: {key} is the key of {owner[key]}")
        chosen[name] = keys
    for action in ACTIONS:
        if action.name not in chosen:
            own = action.keys.split(",")
            chosen[action.name] = [key for key in own if owner.get(key, action.name) == action.name]
            if not chosen[action.name]:
                faults.append(f"{source}: {action.name} has no key left; give it one")
    if faults:
        raise InputError("\n".join(faults))
    return {action.name: ",".join(chosen[action.name]) for action in ACTIONS}
