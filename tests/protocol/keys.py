"""Small protocols around single keys of the reference, by the table of what each key needs."""

import copy
import re

import yaml

from tests.tables import read_table


def value(example: str) -> object:
    return yaml.safe_load(example)


def merge(data: dict, more: dict) -> None:
    for key, part in more.items():
        if part is None:
            data.pop(key, None)
        elif isinstance(part, dict) and isinstance(data.get(key), dict):
            merge(data[key], part)
        else:
            data[key] = copy.deepcopy(part)


def around(path: str, beside: str = __file__) -> dict:
    """A protocol in which the key at a path makes sense."""
    data: dict = {}
    for pattern, more in read_table(beside, "needs"):
        if re.match(pattern, path):
            merge(data, more)
    return data


def put(data: dict, path: str, what: object) -> None:
    *way, last = path.split(".")
    here: object = data
    for part in way:
        if part == "*":
            here = here["B" if last == "like" else "A"]
        elif part == "[]":
            here = here[0]
        else:
            here = here.setdefault(part, {})
    here[last] = what
