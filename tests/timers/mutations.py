"""What happens to a file between its maker and its reader, at random."""

from __future__ import annotations

import random
import re
from typing import NamedTuple

TRANSLATIONS = {
    "time": ("zeit", "temps", "tempo", "tiempo"),
    "gate": ("lichtschranke", "porte", "fotocellula", "puerta"),
    "state": ("zustand", "état", "stato", "estado"),
    "run": ("lauf", "essai", "prova", "ensayo"),
    "blocked": ("unterbrochen", "bloqué", "bloccato", "bloqueado"),
    "channel": ("kanal", "canal", "canale", "voie"),
}
BACK = {word: name for name, listed in TRANSLATIONS.items() for word in listed}
LESS_BY_LINE = 3
"""Edges that a line may have."""


class Mutant(NamedTuple):
    """A file; how many edges it may lack; what was done; how much longer its times may be."""

    content: bytes
    deleted: int
    kind: str
    scale: float = 1.0


def decode(content: bytes) -> tuple[str, str]:
    for encoding, start in (("utf-16", b"\xff\xfe"), ("utf-16-le", b"L\0")):
        if content.startswith(start):
            return content.decode(encoding), encoding
    try:
        return content.decode("utf-8"), "utf-8"
    except UnicodeDecodeError:
        return content.decode("cp1252"), "cp1252"


def _separator(lines: list[str]) -> str:
    return next((s for s in "\t;," if sum(map(str.count, lines, s * len(lines))) > len(lines)), " ")


def _rows(lines: list[str]) -> list[int]:
    return [n for n, line in enumerate(lines) if n > 2 and re.search(r"[0-9]{3}", line)]


def _delete(lines: list[str], rng: random.Random) -> int:
    rows = _rows(lines) or [len(lines) - 1]
    chosen = sorted(rng.sample(rows, rng.randint(1, min(2, len(rows)))), reverse=True)
    # Without two neighbours, levels row by row would say something else.
    chosen = [n for n in chosen if n - 1 not in chosen]
    for n in chosen:
        del lines[n]
    return LESS_BY_LINE * len(chosen)


def _exchange(lines: list[str], rng: random.Random) -> int:
    separator = _separator(lines)
    width = max(line.count(separator) for line in lines) + 1
    if not any('"' in line for line in lines):
        order = rng.sample(range(width), width)
        for n, line in enumerate(lines):
            cells = line.split(separator)
            if len(cells) == width:
                lines[n] = separator.join(cells[k] for k in order)
    return 0


def _replace_words(line: str, pairs) -> str:
    for word, other in pairs:
        line = re.sub(rf"(?i)(?<![^\W\d_]){word}(?![^\W\d_])", other, line)
    return line


def _translate(lines: list[str], rng: random.Random) -> int:
    language = rng.randrange(4)
    pairs = [(word, listed[language]) for word, listed in TRANSLATIONS.items()]
    back = [(word, name) for word, name in BACK.items() if rng.random() < 0.5]
    lines[:] = [_replace_words(_replace_words(line, pairs), back) for line in lines]
    return 0


def _comma(lines: list[str], rng: random.Random) -> int:
    separator = _separator(lines)
    other = rng.choice("\t;") if separator == "," else separator
    if not any('"' in line or ":" in line for line in lines):
        lines[:] = [line.replace(",", other) for line in lines] if separator == "," else lines
        lines[:] = [re.sub(r"(?<=[0-9])\.(?=[0-9])", ",", line) for line in lines]
    return 0


def _blank(lines: list[str], rng: random.Random) -> int:
    for _ in range(3):
        lines.insert(rng.randint(0, len(lines)), rng.choice(("", "", "   ", "\t")))
    return 0


def _comment(lines: list[str], rng: random.Random) -> int:
    for _ in range(2):
        lines.insert(
            rng.randint(0, len(lines)), rng.choice(("# a note", "# run went well", "% 17"))
        )
    return 0


def _append(lines: list[str], rng: random.Random) -> int:
    """Add lines that are no rows."""
    word = rng.choice(("Mean", "end of data", "Total: 8 events", "Average,0.5", "g = 9.7"))
    lines.append(word)
    return 0


def _quote(lines: list[str], rng: random.Random) -> int:
    separator = _separator(lines)
    if separator != " " and not any('"' in line for line in lines):
        rows = rng.random() < 0.5
        for n, line in enumerate(lines):
            if n < 3 or rows:
                lines[n] = separator.join(f'"{cell}"' for cell in line.split(separator))
    return 0


def _behead(lines: list[str], rng: random.Random) -> int:
    """Leave out a line above the data."""
    rows = _rows(lines)
    if rows and rows[0] < len(lines):
        del lines[rng.randrange(max(1, min(rows[0], 20)))]
    return LESS_BY_LINE


def _empty(lines: list[str], rng: random.Random) -> int:
    """Leave a cell without a value."""
    separator = _separator(lines)
    n = rng.choice(_rows(lines) or [len(lines) - 1])
    cells = lines[n].split(separator)
    cells[rng.randrange(len(cells))] = rng.choice(("", "NaN", "--"))
    lines[n] = separator.join(cells)
    return LESS_BY_LINE


KINDS = {
    "delete": _delete, "exchange": _exchange, "translate": _translate, "comma": _comma,
    "blank": _blank, "comment": _comment, "append": _append, "quote": _quote,
    "behead": _behead, "empty": _empty,
}  # fmt: skip


def mutate(content: bytes, seed: int) -> Mutant:
    """Change a file in a way or two."""
    rng = random.Random(seed)
    text, encoding = decode(content)
    scale = 1.0
    if rng.random() < 0.1 and len(re.findall(r"(?<![a-z])\(s\)", text)) > 0:
        text, scale = text.replace("(s)", "(ms)"), 1e-3
    lines, deleted = text.splitlines(), 0
    kinds = rng.sample(sorted(KINDS), rng.choice((1, 1, 2)))
    for kind in kinds:
        deleted += KINDS[kind](lines, rng)
    end = rng.choice(("\n", "\n", "\r\n", "\r"))
    text = end.join(lines) + rng.choice((end, ""))
    if rng.random() < 0.1 and encoding == "utf-8":
        encoding = "utf-8-sig" if not text.startswith("\ufeff") else encoding
    return Mutant(text.encode(encoding, "replace"), deleted, "+".join(kinds), scale)
