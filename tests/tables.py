"""Data of the tests: what is tried and must come of it (`cases.yaml` of a folder), protocols."""

import csv
from functools import cache
from pathlib import Path

import pytest
import yaml

PROTOCOLS = Path(__file__).with_name("protocols")


@cache
def read_table(folder_of: str, name: str):
    """Read a table that lies beside a module."""
    text = Path(folder_of).with_name(f"{name}.yaml").read_text("utf-8")
    return yaml.load(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))


def cases(test):
    """Parametrise a test by the table of its name; a table's first row names the arguments."""
    names, *rows = read_table(test.__code__.co_filename, "cases")[test.__name__]
    return pytest.mark.parametrize(names, rows)(test)


def read_csv(path: Path) -> list[dict[str, str]]:
    """Read the rows of a written table by the names that its first line gives."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def protocol_text(name: str) -> str:
    """Return the text of a protocol that several tests change and read."""
    return (PROTOCOLS / f"{name}.yaml").read_text("utf-8")
