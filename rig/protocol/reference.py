"""The table of keys as others read it: the page `docs/protocol.md`, and the JSON Schema of editors.

Tests read every example of the table with the reader itself.
"""

from __future__ import annotations

from typing import Any

from rig.protocol.keys import (
    ANY,
    BOOLEANS,
    EACH,
    KEYS,
    SECTIONS,
    Accepted,
    Either,
    Key,
    ListOf,
    Mapped,
    OneOf,
    OneOrMore,
    Range,
    Whole,
)
from rig.units import Dimension


def page() -> str:
    """Write the reference as Markdown."""
    lines = [
        "# The protocol file",
        "",
        "What may stand in a protocol? One YAML file describes one experiment. `rig check FILE`",
        "reads it, `rig check --keys` prints this page, and `rig check --schema` a JSON Schema for",
        "editors. Examples are in [protocols](../protocols).",
        "",
        "Quantities have a unit (`48.5 mm`) and may have a standard uncertainty (`180 mm ± 2 mm`,",
        "`9.8124(2) m/s^2`); *±* marks where. `*` is the name of a chain, `[]` an item of a list.",
        "**Bold** keys are required within their section.",
        "",
        "| key | accepted | without it | meaning | example |",
        "|---|---|---|---|---|",
    ]
    for key in KEYS:
        name = f"**`{key.path}`**" if key.required else f"`{key.path}`"
        example = f"`{key.example}`" if key.example else ""
        lines.append(f"| {name} | {key.accepted} | {key.default} | {key.meaning} | {example} |")
    lines += [
        "",
        "## Where the defaults of `priors` come from",
        "",
        "| key | source |",
        "|---|---|",
    ]
    lines += [f"| `{name}` | {key.source} |" for name, key in SECTIONS["priors"].items()]
    return "\n".join(lines) + "\n"


def schema() -> dict[str, Any]:
    """Make the JSON Schema (draft 2020-12) of a protocol file."""
    root = _object("", "A protocol of falling chains and photogates")
    return root | {"$schema": "https://json-schema.org/draft/2020-12/schema"}


def _object(path: str, description: str) -> dict[str, Any]:
    """Return the schema of the mapping at a path."""
    head: dict[str, Any] = {"type": "object"}
    if description:
        head["description"] = description
    if path not in SECTIONS:
        inner = _object(f"{path}.{ANY}", "a chain")
        return head | {"additionalProperties": inner, "minProperties": 1, "maxProperties": 2}
    keys = SECTIONS[path]
    head["properties"] = {name: _property(key) for name, key in keys.items()}
    head["additionalProperties"] = False
    required = [name for name, key in keys.items() if key.required]
    # What a chain is like another one in, it need not say again.
    return head | ({"required": required} if required and not path.endswith(ANY) else {})


def _property(key: Key) -> dict[str, Any]:
    """Return the schema of a key."""
    words = [key.meaning] if isinstance(key.accepted, Mapped) else [key.meaning, str(key.accepted)]
    if key.default:
        words.append(f"without it: {key.default}")
    examples = {"examples": [key.example]} if key.example else {}
    return {"description": "; ".join(words), **_values(key.path, key.accepted), **examples}


def _values(path: str, accepted: Accepted) -> dict[str, Any]:
    """Return the schema of what a key may be."""
    match accepted:
        case Range(dimension):
            # A text with a unit, or a number where none is needed.
            plain = dimension is Dimension.NUMBER
            return {"type": ["string", "number"] if plain else ["string"]}
        case Whole(low, high):
            return {"type": "integer", "minimum": low, "maximum": high}
        case OneOf(words):
            # YAML reads a bare true as a boolean.
            booleans = dict.fromkeys(BOOLEANS[word] for word in words if word in BOOLEANS)
            return {"enum": [*words, *booleans]}
        case OneOrMore(each):
            return {"anyOf": [_values(path, each), _values(path, ListOf(each))]}
        case Either(kinds):
            return {"anyOf": [_values(path, kind) for kind in kinds]}
        case ListOf(each):
            items = _values(path, each) if each else _object(f"{path}.{EACH}", "an item")
            return {"type": "array", "items": items, "minItems": 1}
        case Mapped():
            return _object(path, "")
    return {"type": "string"}
