"""Conversion of results to JSON data: members are attributes, mostly under the same names."""

import math
from collections.abc import Iterable, Mapping
from operator import attrgetter
from typing import Any, ClassVar


class Record:
    """A result whose JSON members are its attributes.

    Attributes
    ----------
    MEMBERS
        The members in order, as `attributes` reads them, separated by blanks.
    """

    __slots__ = ()
    MEMBERS: ClassVar[str]

    def json(self) -> dict[str, Any]:
        """Return the result as JSON data."""
        return attributes(self, *self.MEMBERS.split())


def attributes(result: object, *members: str) -> dict[str, Any]:
    """Return attributes of a result as JSON data.

    Parameters
    ----------
    members
        Name or path of each attribute. ``key=path`` gives it another key, ``*path`` merges its own
        members, and ``?`` at the end leaves it out where it is empty: `None`, `False`, or nothing
        counted.
    """
    fields: dict[str, Any] = {}
    for member in members:
        key, _, path = member.strip("*?").rpartition("=")
        value = attrgetter(path)(result)
        if member.endswith("?") and not value and not isinstance(value, float):
            continue
        fields |= plain(value) if member.startswith("*") else {key or path: plain(value)}
    return fields


def spread(budgets: Mapping[str, Mapping[str, float]]) -> list[dict[str, Any]]:
    """Return the contributions of sources to quantities as JSON data, by quantity and source."""
    return [
        {"name": source, "quantity": quantity, "u": u}
        for quantity, budget in budgets.items()
        for source, u in budget.items()
    ]


def plain(value: Any) -> Any:
    """Return a value as JSON data; results by their `json`, non-finite numbers as `None`."""
    if hasattr(value, "json"):
        return value.json()
    if isinstance(value, Mapping):
        return {name: plain(member) for name, member in value.items()}
    if hasattr(value, "tolist"):  # an array; avoids the import of numpy
        return value.tolist()
    if isinstance(value, Iterable) and not isinstance(value, str):
        return [plain(member) for member in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
