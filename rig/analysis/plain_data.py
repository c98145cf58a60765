"""Conversion of results to JSON data: printed fields are attributes, under the same names."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any


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


def attributes(result: object, *names: str) -> dict[str, Any]:
    """Return attributes of a result as JSON data, by name."""
    return {name: plain(getattr(result, name)) for name in names}
