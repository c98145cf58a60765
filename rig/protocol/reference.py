"""Reference of the keys: the page `docs/protocol.md`, and the JSON Schema for editors.

Tests read every example of the table with the reader itself.
"""

from string import Template
from typing import Any

from rig.protocol import keys
from rig.text_rows import read_text
from rig.units import DIMENSIONS


def page() -> str:
    """Return the reference as Markdown."""
    rows = []
    for key in keys.KEYS.values():
        name = f"**`{key.path}`**" if key.required else f"`{key.path}`"
        example = f"`{key.example}`" if key.example else ""
        rows.append(f"| {name} | {key.accepted} | {key.default} | {key.meaning} | {example} |")
    sources = [f"| `{name}` | {key.source} |" for name, key in keys.SECTIONS["priors"].items()]
    page = Template(read_text(__file__))
    return page.substitute(keys="\n".join(rows), sources="\n".join(sources))


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a protocol file."""
    root = _object("", "A protocol of falling chains and photogates")
    return root | {"$schema": "https://json-schema.org/draft/2020-12/schema"}


def _object(path: str, description: str) -> dict[str, Any]:
    """Return the schema of the mapping at a path."""
    head: dict[str, Any] = {"type": "object"}
    head |= {"description": description} if description else {}
    if path == "plan.vary":
        return head | {"additionalProperties": {"type": "array", "minItems": 1}}
    if path not in keys.SECTIONS:
        inner = _object(f"{path}.*", "a chain")
        return head | {"additionalProperties": inner, "minProperties": 1, "maxProperties": 2}
    table = keys.SECTIONS[path]
    properties = {name: _property(key) for name, key in table.items()}
    head |= {"properties": properties, "additionalProperties": False}
    required = [name for name, key in table.items() if key.required]
    # A chain may inherit required keys from another by `like`.
    return head | ({"required": required} if required and not path.endswith(keys.ANY) else {})


def _property(key: keys.Key) -> dict[str, Any]:
    """Return the schema of a key."""
    accepted = "" if key.accepted is keys.Plain.MAPPED else f"; {key.accepted}"
    default = key.default and f"; without it: {key.default}"
    examples = {"examples": [key.example]} if key.example else {}
    description = f"{key.meaning}{accepted}{default}"
    return {"description": description, **_values(key.path, key.accepted), **examples}


def _values(path: str, accepted: keys.Accepted) -> dict[str, Any]:
    """Return the schema of the accepted values of a key."""
    match accepted:
        case keys.Range(dimension):
            # A text with a unit, or a plain number for a dimensionless quantity.
            plain = dimension is DIMENSIONS["NUMBER"]
            return {"type": ["string", "number"] if plain else ["string"]}
        case keys.Whole(low, high):
            return {"type": "integer", "minimum": low, "maximum": high}
        case keys.OneOf(words):
            # YAML reads a bare true as a boolean.
            booleans = dict.fromkeys(keys.BOOLEANS[word] for word in words if word in keys.BOOLEANS)
            return {"enum": [*words, *booleans]}
        case keys.Either(kinds):
            return {"anyOf": [_values(path, kind) for kind in kinds]}
        case keys.ListOf(each):
            items = _values(path, each) if each else _object(f"{path}.{keys.EACH}", "an item")
            return {"type": "array", "items": items, "minItems": 1}
        case keys.Plain.MAPPED:
            return _object(path, "")
    return {"type": "string"}
