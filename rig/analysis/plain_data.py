"""Results as plain data: what is printed of a result are attributes of it, by their names."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any


def plain(value: Any) -> Any:
    """Return a value as JSON has it: results as they print themselves, no number that is none."""
    if hasattr(value, "json"):
        return value.json()
    if isinstance(value, Mapping):
        return {name: plain(member) for name, member in value.items()}
    if hasattr(value, "tolist"):  # an array: who asks for none need not load what makes them
        return value.tolist()
    if isinstance(value, Iterable) and not isinstance(value, str):
        return [plain(member) for member in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def attributes(result: object, *names: str) -> dict[str, Any]:
    """Return attributes of a result as JSON has them."""
    return {name: plain(getattr(result, name)) for name in names}
