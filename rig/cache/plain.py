"""Results as JSON text and back, to the last bit.

Not pickle: what is read back can only be numbers, texts and plain records of this program,
whoever wrote it.
"""

import base64
import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from importlib import import_module
from typing import Any

import numpy as np

_ARRAY, _MAPPING = "array", "mapping"
_SEQUENCES = {"list": list, "tuple": tuple}
_SCALARS = (type(None), bool, int, float, str)


def to_text(value: object) -> str:
    """Write plain records: dataclasses, named tuples, mappings, lists, tuples, arrays and scalars.

    Fields that do not take part in comparisons are left out: they have their defaults again.

    Raises
    ------
    TypeError
        There is something else in it.
    """
    return json.dumps(_plain(value), ensure_ascii=False, separators=(",", ":"))


def from_text(text: str) -> Any:
    """Read what `to_text` wrote.

    Raises
    ------
    ValueError
        It is something else.
    """
    try:
        return _record(json.loads(text))
    except (AttributeError, ImportError, LookupError, RecursionError, TypeError) as error:
        raise ValueError(f"no kept result: {error}") from error


def _plain(value: Any) -> object:
    if type(value) in _SCALARS:
        return value
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return [_ARRAY, value.dtype.str, value.shape, base64.b64encode(value.tobytes()).decode()]
    if isinstance(value, Mapping):
        return [_MAPPING, [*map(_plain, value)], [*map(_plain, value.values())]]
    kind: Any = type(value)
    if kind in _SEQUENCES.values():  # rods of hundreds of edges: most need no call
        return [kind.__name__, *(x if type(x) in _SCALARS else _plain(x) for x in value)]
    parts = (_plain(getattr(value, name)) for name in _fields(kind))
    return [f"{kind.__module__}:{kind.__qualname__}", *parts]


def _record(value: Any) -> Any:
    if type(value) is not list:
        return value
    kind, *parts = value
    if kind == _ARRAY:
        dtype, shape, data = parts
        return np.frombuffer(base64.b64decode(data), np.dtype(dtype)).reshape(shape).copy()
    if kind == _MAPPING:
        keys, values = parts
        return dict(zip(map(_record, keys), map(_record, values), strict=True))
    records = [_record(part) if type(part) is list else part for part in parts]
    if kind in _SEQUENCES:
        return _SEQUENCES[kind](records)
    record_type = _class(kind)
    return record_type(**dict(zip(_fields(record_type), records, strict=True)))


@cache
def _fields(kind: type) -> tuple[str, ...]:
    """Name the fields of a plain record.

    Raises
    ------
    TypeError
        It is none of this program.
    """
    if kind.__module__.startswith("rig."):
        if is_dataclass(kind):
            return tuple(field.name for field in fields(kind) if field.compare)
        if issubclass(kind, tuple) and hasattr(kind, "_fields"):
            return tuple(kind._fields)
    raise TypeError(f"{kind} is no plain record")


@cache
def _class(kind: str) -> type:
    module, _, name = kind.partition(":")
    if not module.startswith("rig."):
        raise ImportError(kind)
    return getattr(import_module(module), name)  # type: ignore[no-any-return]
