"""Why a drop is not simply accepted, or a request refused: codes with values.

Whoever finds something returns ``Reason(code, values)``; a row of ``wordings.txt`` says how bad it
is, what it is called, how it reads and what to do about it. Sentences are written here, never read
back.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from enum import IntEnum
from pathlib import PurePath
from string import Formatter, Template
from typing import Any, NamedTuple

from rig import errors
from rig.errors import RigError
from rig.text_rows import read_paragraphs
from rig.units import Quantity, format_quantity
from rig.vocabulary import ANY_SCENE, VOCABULARIES, Vocabulary

OPERATOR, NOTE, SENTENCE = "operator", "note", "sentence"
"""Codes of what is only text: a cause to reject a drop, a note to it, a sentence of an old file."""


class Severity(IntEnum):
    """What a reason does to a verdict."""

    REMARK = 0
    DOUBT = 1
    VOID = 2


class Wording(NamedTuple):
    """What the program says of one code.

    Attributes
    ----------
    severity
        What it does to a verdict.
    sentence
        With places for values, see `rig.reasons`.
    remedy
        What to do about it; empty where nothing is to be done.
    label
        In a few words, where several drops have it; empty where the code says it.
    error
        What a request ends with that is refused for it.
    """

    severity: Severity
    sentence: str
    remedy: str
    label: str
    error: type[RigError]


(_, *_TEXTS), *_PARAGRAPHS = read_paragraphs(__file__, "wordings.txt")
_SHARED = dict(line.strip().split(": ", 1) for line in _TEXTS)
"""What several sentences say, by name."""


def _wording(head: str, *lines: str) -> tuple[str, Wording]:
    """Read a paragraph of the table: a code, and what the program says of it."""
    name, _, label = head.partition(": ")
    kind, code = name.split()
    error = vars(errors).get(kind)
    severity = Severity[kind.upper()] if error is None else Severity.VOID
    sentence, *remedy = (Template(line.strip()).safe_substitute(_SHARED) for line in lines)
    return code, Wording(severity, sentence, "".join(remedy), label, error or RigError)


WORDINGS = dict(_wording(*paragraph) for paragraph in _PARAGRAPHS)


@dataclass(frozen=True, slots=True)
class Reason:
    """One reason.

    Attributes
    ----------
    code
        A key of `WORDINGS`.
    values
        What it was found with, in SI units as the names end, angles in degrees; ``U95`` is the
        expanded uncertainty of the other number. Only what JSON has.
    text
        Its sentence, in the words of its scene.
    scene
        Whose words these are, a key of `VOCABULARIES`.
    """

    code: str
    values: Mapping[str, Any] = field(default_factory=dict, hash=False)
    text: str = ""
    scene: str = ""

    def __str__(self) -> str:
        return self.text

    @property
    def severity(self) -> Severity:
        """What it does to a verdict."""
        return WORDINGS[self.code].severity

    @property
    def kind(self) -> tuple[object, ...]:
        """The same for reasons that differ in their numbers only."""
        words = {name: value for name, value in self.values.items() if isinstance(value, str)}
        faults = self.values.get("candidates", ())
        return self.code, *sorted(words.items()), *(fault["code"] for fault in faults)

    def json(self) -> dict[str, Any]:
        """Return it as a member of ``reason_codes``."""
        return {"code": self.code, "values": dict(self.values)}

    def record(self) -> dict[str, Any]:
        """Return it with its sentence, for a log; `read_record` takes it back."""
        return asdict(self)


def read_record(record: object) -> Reason:
    """Take a reason from a log; of a code that this program does not know the sentence remains.

    Raises
    ------
    TypeError
        Something else.
    """
    match record:
        case {"code": str(code), "values": dict(values), "text": str(text), "scene": str(scene)}:
            is_known = code in WORDINGS and scene in VOCABULARIES
            return Reason(code, values, text, scene) if is_known else plain_reason(text)
    raise TypeError(f"{record!r:.40} is no reason")


def plain_reason(text: str, code: str = SENTENCE) -> Reason:
    """Make a reason of somebody's words."""
    return make_reason(code, text=text)


def make_reason(code: str, words: Vocabulary = ANY_SCENE, /, **values: Any) -> Reason:
    """Make a reason with its sentence in the words of a scene; values as in `Reason`."""
    sentence = WORDINGS[code].sentence + " (odds {odds} to 1)" * ("log_odds" in values)
    return Reason(code, values, _Phrases(values, words).fill(sentence), words.scene)


def rig_error(code: str, /, **values: Any) -> RigError:
    """Make the error that refuses a request; its class, message and hint are the table's.

    Parameters
    ----------
    code, **values
        As for `make_reason`; of a path its name is kept, of an exception its words.
    """
    words = {name: _plain_value(value) for name, value in values.items()}
    return error_of(WORDINGS[code].error, make_reason(code, **words))


@contextmanager
def errors_become(code: str, *kinds: type[Exception], **values: Any) -> Iterator[None]:
    """Turn errors of some kinds in a block into that of a code; their words are its ``text``."""
    try:
        yield
    except kinds as error:
        raise rig_error(code, **values, text=error) from error


def _plain_value(value: object) -> object:
    text = getattr(value, "strerror", None) or value
    return str(text) if isinstance(value, Exception | PurePath) else value


def error_of(kind: type[RigError], reason: Reason) -> RigError:
    """Make an error of a reason."""
    error = kind(reason.text, *remedies([reason]))
    error.reasons = (reason,)
    return error


def sentences(reasons: Iterable[Reason]) -> str:
    """Return the sentences of some reasons in one line."""
    return "; ".join(reason.text for reason in reasons)


def notes_in(reasons: Iterable[Reason]) -> list[str]:
    """Return the operator's notes among some reasons."""
    return [reason.values["text"] for reason in reasons if reason.code == NOTE]


def reasons_json(
    reasons: Sequence[Reason], write: Callable[[Reason], dict[str, Any]] = Reason.json
) -> dict[str, list[Any]]:
    """Return reasons as JSON has them: ``reasons`` for people, ``reason_codes`` for programs.

    A daemon publishes `Reason.record` of each, for `read_record`.
    """
    return {"reasons": [reason.text for reason in reasons], "reason_codes": [*map(write, reasons)]}


def remedies(reasons: Iterable[Reason]) -> list[str]:
    """Return what to do about some reasons, each thing once; the general advice only if alone."""
    advice = [
        _Phrases(reason.values, VOCABULARIES[reason.scene]).fill(WORDINGS[reason.code].remedy)
        for reason in reasons
    ]
    advice = [text for text in dict.fromkeys(advice) if text]
    return [text for text in advice if text != _SHARED["look"]] or advice


def summarize_reasons(reasons: Sequence[Reason]) -> str:
    """Return the sentence of reasons of one kind; where they are not all the same, their label.

    Behind the label stands what tells them from others of their code.
    """
    first = reasons[0]
    if all(reason == first for reason in reasons):
        return first.text
    words = ", ".join(value for value in first.values.values() if isinstance(value, str))
    label = WORDINGS[first.code].label or first.code.replace("_", " ")
    return f"{label} ({words})" if words else label


class _Phrases(dict[str, Any], Formatter):
    """What may stand in a sentence: values, words of the scene, and phrases made of both."""

    def __init__(self, values: Mapping[str, Any], words: Vocabulary) -> None:
        super().__init__(values)
        self.words = words

    def __missing__(self, name: str) -> object:
        return _PHRASES[name](self) if name in _PHRASES else getattr(self.words, name)

    def format_field(self, value: Any, spec: str) -> str:
        """Write ``more|less`` by sign, ``.1f mm`` of metres, how many there are of a ``run``."""
        if "|" in spec:
            return spec.split("|")[bool(value <= 0.0)]
        digits, _, unit = spec.partition(" ")
        if unit:
            return f"{value * 1e3:{digits}} {unit}"
        if len(spec) > 1 and spec.isalpha():
            return f"{value} {spec}{'s' * (value != 1)}"
        return format(value, spec)

    def fill(self, sentence: str) -> str:
        """Return a sentence with all that it names."""
        return self.vformat(sentence, (), self)


def _gate(gate: Mapping[str, Any], words: Vocabulary) -> str:
    side = f"{gate['side']} side, " if words.two_sides else ""
    return f"the gate on channel {gate['channel']} ({side}{gate['height_m'] * 1e3:g} mm)"


def _inputs(channels: Sequence[int]) -> str:
    if not channels:  # a flicker so short that the device cannot say whose
        return "a gate"
    return f"gate{'s' * (len(channels) > 1)} {', '.join(map(str, channels))}"


def _side(phrases: _Phrases) -> str:
    side = phrases.get("side")
    return f" on the {side} side" if side and phrases.words.two_sides else ""


def _chain(phrases: _Phrases) -> str:
    if phrases.words.part != "rod":
        return phrases.words.body
    return f"chain {phrases['name']}" if phrases["name"] else "each chain"


def _each_part(phrases: _Phrases) -> str:
    words = phrases.words
    if words.body.endswith(words.part):  # the object is its own only part
        return words.body
    return f"every {words.part} of {_chain(phrases)}"


def _format_measured(phrases: _Phrases, name: str) -> str:
    end, unit = ("m_s", "m/s") if f"{name}_m_s" in phrases else ("m", "mm")
    return format_quantity(Quantity(phrases[f"{name}_{end}"], phrases[f"{name}_U95"]), unit)


_LEAST_MM = 0.1
_PHRASES: dict[str, Callable[[_Phrases], str]] = {
    "gate": lambda p: _gate(p, p.words),
    "gates": lambda p: " and ".join(_gate(gate, p.words) for gate in p["at"]),
    "inputs": lambda p: _inputs(p["channels"]),
    "are": lambda p: "are" if len(p["channels"]) > 1 else "is",
    "on_side": _side,
    "odds": lambda p: (
        f"{math.exp(p['log_odds']):.0f}" if p["log_odds"] < math.log(1e4) else "more than 10,000"
    ),
    "alone": lambda p: _format_measured(p, "alone"),
    "whole": lambda p: _format_measured(p, "whole"),
    "chain": _chain,
    "each_part": _each_part,
    "size": lambda p: f"{abs(p['size_m']) * 1e3:.1f} ± {max(p['U95_m'] * 1e3, _LEAST_MM):.1f} mm",
    "relative": lambda p: f"{abs(p['share']):.2%} ± {max(p['U95'], 1e-4):.2%}",
    "share_of_edges": lambda p: format(
        p["missed"] / p["expected"] if "missed" in p else p["unexplained"] / p["received"], ".1%"
    ),
    "faults": lambda p: "; or ".join(
        make_reason(fault["code"], p.words, **fault["values"]).text for fault in p["candidates"]
    ),
}
