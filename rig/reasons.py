"""Why a drop is not simply accepted: codes with values, and the one table of their sentences.

Whoever finds something returns ``Reason(code, values)``; `WORDINGS` says how bad it is, what it is
called, how it reads and what to do about it. Sentences are written here and never read back.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Any

from rig.units import Quantity, format_quantity
from rig.vocabulary import ANY_SCENE, VOCABULARIES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from rig.vocabulary import Vocabulary

OPERATOR, NOTE, SENTENCE = "operator", "note", "sentence"
"""Codes of what is only text: a cause to reject a drop, a note to it, a sentence of an old file."""


class Severity(IntEnum):
    """What a reason does to a verdict."""

    REMARK = 0
    DOUBT = 1
    VOID = 2


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
        return {**self.json(), "text": self.text, "scene": self.scene}


def read_record(record: object) -> Reason:
    """Take a reason from a log; of a code that this program does not know the sentence remains.

    Raises
    ------
    TypeError
        Something else.
    """
    match record:
        case {"code": str(code), "values": dict(values), "text": str(text), "scene": str(scene)}:
            known = code in WORDINGS and scene in VOCABULARIES
            return Reason(code, values, text, scene) if known else plain_reason(text)
    raise TypeError(f"{record!r:.40} is no reason")


def plain_reason(text: str, code: str = "sentence") -> Reason:
    """Make a reason of somebody's words."""
    return make_reason(code, text=text)


@dataclass(frozen=True, slots=True)
class Wording:
    """What the program says of one code.

    Attributes
    ----------
    severity
        What it does to a verdict.
    label
        In a few words, where several drops have it.
    sentence
        With places for values, see `_Phrases`.
    remedy
        What to do about it; empty where nothing is to be done.
    """

    severity: Severity
    label: str
    sentence: str
    remedy: str = ""


_VOID, _DOUBT, _REMARK = Severity.VOID, Severity.DOUBT, Severity.REMARK
_COMPARE = "compare {setup} with rig check PROTOCOL"
_LOOK = "look at the drop's edges: rig report SESSION draws them beside the expected fall"
_BEAM = "clear and align the gate's beam, or measure its height again"
_HEIGHT = "measure the gate's height again and correct the protocol"
_BOARD = "check cable and supply of the board, then drop again; rig selftest tests them"
_MISSED = (
    "align the gates' beams with {body}; rig report SESSION shows which gate misses most edges"
)
_STRAY = (
    "keep everything else out of the beams and give each gate its own channel; "
    "rig report SESSION draws every edge"
)
_SKEW = "adjust the releases until both chains leave together, or raise accept.release_skew"
_AGAIN = "drop again"

WORDINGS: dict[str, Wording] = {
    # The record.
    "edges_lost": Wording(
        _VOID, "edges lost", "the board lost {lost} edges because its memory was full",
        "find the gate that flickers, then shield or unplug it",
    ),
    "no_identity": Wording(
        _VOID, "board unknown", "the board never identified itself, so its tick rate is unknown",
        _BOARD,
    ),
    "restarted": Wording(
        _VOID, "board restarted", "the board restarted before the drop was read", _BOARD
    ),
    "no_certificate": Wording(
        _VOID, "record not closed", "no certificate: the board did not close the record", _BOARD
    ),
    "events_missing": Wording(
        _VOID, "events missing", "{missing} of {events} events missing, from number {first}", _BOARD
    ),
    "events_overwritten": Wording(
        _VOID, "events overwritten",
        "{missing} of {events} events no longer kept by the board, from number {first}", _BOARD,
    ),
    "crc_mismatch": Wording(
        _VOID, "checksum wrong", "the events do not match the certificate's CRC-32", _BOARD
    ),
    "record_damaged": Wording(
        _VOID, "record damaged", "damaged: {text}; see rig recover SESSION",
        "rig recover SESSION says what is whole, and with -o NEW saves it",
    ),
    "record_torn": Wording(
        _VOID, "record torn", "a part of the record was lost with its file",
        "measure this run again",
    ),
    "pulse_cut": Wording(
        _VOID, "release cut short",
        "the release pulse ended after {lasting_s:.3g ms}: the board found it out of order",
        "look for a short circuit at the release's output; rig selftest tests it",
    ),
    "pulse_stopped": Wording(
        _VOID, "release cut short",
        "the release pulse ended after {lasting_s:.3g ms}: the emergency stop opened",
        "drop again; if nobody opened the stop, shield its cable and put 47 nF across it at the "
        "board",
    ),
    "pulse_aborted": Wording(
        _VOID, "release cut short",
        "the release pulse ended after {lasting_s:.3g ms}: the drop was aborted", _AGAIN,
    ),
    "connection_ended": Wording(
        _VOID, "connection ended", "the connection ended before the drop was recorded", _AGAIN
    ),
    # Which edge is what.
    "few_edges_fit": Wording(
        _VOID, "no such fall",
        "only {share:.0%} of the expected edges{on_side} fit a fall of {body}", _COMPARE,
    ),
    "no_fall": Wording(
        _VOID, "no such fall", "no fall of {body} fits enough of the edges", _COMPARE
    ),
    "two_falls": Wording(
        _VOID, "two falls fit",
        "two falls fit these edges: the likelier has odds of {odds:.3g} to 1",
        "add or move a gate; rig check PROTOCOL says how many simulated drops are identified then",
    ),
    "two_falls_gate": Wording(
        _VOID, "two falls fit",
        "two falls fit these edges: the likelier has odds of {odds:.3g} to 1; one more gate at "
        "{height_m:.0f mm}{on_side} would decide",
        "put a gate there, or move one; rig check PROTOCOL says how many simulated drops are "
        "identified then",
    ),
    "edges_missed": Wording(
        _VOID, "edges missed",
        "{missed} of {expected} edges missed ({share_of_edges}), limit {limit:.1%}", _MISSED,
    ),
    "edges_missed_few": Wording(
        _DOUBT, "edges missed",
        "{missed} of {expected} edges missed ({share_of_edges}), limit {limit:.1%}; of so few "
        "edges this may be chance", _MISSED,
    ),
    "edges_unexplained": Wording(
        _VOID, "edges unexplained",
        "{unexplained} of {received} edges unexplained ({share_of_edges}), limit {limit:.1%}",
        _STRAY,
    ),
    "edges_unexplained_few": Wording(
        _DOUBT, "edges unexplained",
        "{unexplained} of {received} edges unexplained ({share_of_edges}), limit {limit:.1%}; this "
        "may be one stray pulse", _STRAY,
    ),
    "later_passages": Wording(
        _REMARK, "later passages",
        "{edges} edges after the passage were left out: {body} came back",
    ),
    # Gates.
    "gate_silent": Wording(
        _DOUBT, "gate silent", "{gate} gave no edges: dead or not plugged in",
        "plug the gate in, and see that it changes when a hand is in its beam",
    ),
    "side_silent": Wording(
        _DOUBT, "gates silent", "the gates{on_side} gave no edges: dead or not plugged in",
        "plug the gates in, and see that each changes when a hand is in its beam",
    ),
    "gate_disagrees": Wording(
        _VOID, "gate sees something else",
        "{gate} sees something else: only {share:.0%} of its expected edges are there", _BEAM,
    ),
    "gate_disagrees_few": Wording(
        _DOUBT, "gate sees something else",
        "{gate} sees something else: only {share:.0%} of its expected edges are there", _BEAM,
    ),
    "gate_off": Wording(
        _VOID, "gate off its height",
        "{gate} is off its height by {deviations:.0f} times its uncertainty", _HEIGHT,
    ),
    "rods_pile_up": Wording(
        _VOID, "rods pile up",
        "rods pile up on the surface: {gates} miss rods that higher gates see, and the last rods "
        "strike those that lie there", "incline the surface more, or use fewer rods",
    ),
    "low_gates_miss_rods": Wording(
        _VOID, "low gates miss rods",
        "{gates} miss rods that higher gates see, though the last rods pass: rods before them "
        "strike too early, or the gate misses some",
        "let the chains hang still before the release, or put the lowest gate higher",
    ),
    # What the fit says.
    "release_skew": Wording(
        _VOID, "release skew", "release skew {skew_s:.2f ms} exceeds the limit of {limit_s:g ms}",
        _SKEW,
    ),
    "release_skew_near": Wording(
        _DOUBT, "release skew",
        "release skew {skew_s:.2f ms} is within its uncertainty of the limit of {limit_s:g ms}",
        _SKEW,
    ),
    "scatter": Wording(
        _DOUBT, "scatter",
        "edges scatter {factor:.1f} times as much as stated; uncertainties are enlarged to match",
        _LOOK,
    ),
    "not_converged": Wording(
        _DOUBT, "fit did not converge", "the fit did not converge: no motion fits these edges well",
        _LOOK,
    ),
    "late_stamps": Wording(
        _DOUBT, "late time stamps", "{edges} time stamps may be late",
        "look for noise on the gates' cables: many edges came almost at once",
    ),
    "short_pulses": Wording(
        _DOUBT, "short pulses", "{pulses} pulses were too short to be timed",
        "look for noise on the gates' cables, and shield them",
    ),
    "air_implausible": Wording(
        _VOID, "no such fall",
        "no fall of {body} fits: even with implausible air (κ = {kappa:.2g} per m) edges scatter "
        "{factor:.1f} times as much as stated", _COMPARE,
    ),
    "air_accelerates": Wording(
        _DOUBT, "air would accelerate",
        "the fit needs air that accelerates {body} (κ = {kappa:.2g} ± {U95:.1g} per m): the clock, "
        "the gates' heights or gravity are not as stated", _COMPARE,
    ),
    "other_incline": Wording(
        _REMARK, "incline or surface",
        "the impacts (α = {alpha:.3f} ± {U95:.1g}) are those of an incline of {likelier_deg:g}°, "
        "not {stated_deg:g}°, or the surface is not as stated",
        "set the board to the run's incline, or correct the surface in the protocol",
    ),
    "last_speed_differs": Wording(
        _DOUBT, "end of the fall",
        "the last passages alone give V = {alone}, the whole fall {whole}: the end of the fall "
        "differs from the model",
        _LOOK,
    ),
    "last_separation_differs": Wording(
        _DOUBT, "end of the fall",
        "the last passages alone give Δz as it fell = {alone}, the whole fall {whole}: the end of "
        "the fall differs from the model", _LOOK,
    ),
    "differs_from_session": Wording(
        _REMARK, "differs from the session",
        "only {matched} of its {alone} edges fit together with the other runs: gates or {body} "
        "may have been moved; this run is measured by itself", _COMPARE,
    ),
    # What would explain a drop.
    "unclear_fault": Wording(_VOID, "several possible faults", "possible, but not clear: {faults}",
                         _COMPARE),
    "rod_missing": Wording(
        _VOID, "rod missing",
        "no gate saw {part} {rod} of {rods} (from the bottom) of {chain}{on_side}: it is missing",
        "put the missing {part} in, or write the real spacing into the protocol",
    ),
    "rod_count": Wording(
        _VOID, "number of rods", "{chain} has {rods} {part}s, not {stated} as the protocol says",
        "use what the protocol describes, or correct the number of rods in the protocol",
    ),
    "chain_length": Wording(
        _VOID, "chain length",
        "{chain} is {size} {size_m:longer|shorter} than the protocol says",
        "measure the length again and correct the protocol",
    ),
    "thickness": Wording(
        _VOID, "thickness", "{each_part} looks {size} {size_m:thicker|thinner} than the protocol "
        "says", "measure the diameter and the width of the beams again, and state what a beam sees",
    ),
    "upside_down": Wording(
        _VOID, "upside down", "{chain} hangs upside down{on_side}", "turn the chain round"
    ),
    "chains_exchanged": Wording(
        _VOID, "chains exchanged", "chains {impact} and {free} hang on each other's side",
        "exchange the two chains, or hang them as the run asks",
    ),
    "drop_height": Wording(
        _VOID, "drop height", "{start} {size} {size_m:higher|lower} than the protocol says",
        "measure the drop again and correct the protocol",
    ),
    "clock": Wording(
        _VOID, "clock", "the timer's clock is {relative} {share:slow|fast}",
        "state how well the timer's clock is known, or compare it: rig import --help",
    ),
    "air": Wording(
        _VOID, "air",
        "the air slows {body} by κ = {kappa:.2g} ± {U95:.1g} per m, not as the protocol says",
        "correct or leave out drag in the protocol, or use heavier objects",
    ),
    "all_gates": Wording(
        _VOID, "all gates off",
        "all gates are {size} {size_m:higher|lower} above the contact point than the protocol says",
        "measure the gates from the contact point, not from the board",
    ),
    "gravity": Wording(
        _VOID, "gravity", "gravity is {relative} {share:more|less} than the protocol says",
        "use site: with your latitude and height in the protocol",
    ),
    "post": Wording(
        _VOID, "post off", "the {side} side's post is {size} {size_m:higher|lower} than the "
        "protocol says", "measure that post's zero against the other post's",
    ),
    "gate_height": Wording(
        _VOID, "gate off its height",
        "{gate} is {size} {size_m:higher|lower} than the protocol says", _HEIGHT,
    ),
    "gates_exchanged": Wording(
        _VOID, "gates exchanged", "{gates} are exchanged",
        "exchange the two plugs, or their channels in the protocol",
    ),
    # Words of people and of old files.
    OPERATOR: Wording(_VOID, "rejected by the operator", "{text}"),
    NOTE: Wording(_REMARK, "note", "note: {text}"),
    SENTENCE: Wording(_VOID, "", "{text}", _LOOK),
}  # fmt: skip
"""What the program says of each code."""


def make_reason(code: str, words: Vocabulary = ANY_SCENE, /, **values: Any) -> Reason:
    """Make a reason with its sentence in the words of a scene; values as in `Reason`."""
    sentence = WORDINGS[code].sentence.format_map(_Phrases(values, words))
    if "log_odds" in values:
        sentence += f" (odds {_odds(values['log_odds'])} to 1)"
    return Reason(code, values, sentence, words.scene)


def sentences(reasons: Iterable[Reason]) -> str:
    """Return the sentences of some reasons in one line."""
    return "; ".join(reason.text for reason in reasons)


def notes_in(reasons: Iterable[Reason]) -> list[str]:
    """Return the operator's notes among some reasons."""
    return [reason.values["text"] for reason in reasons if reason.code == NOTE]


def reasons_json(reasons: Sequence[Reason]) -> dict[str, list[Any]]:
    """Return reasons as JSON has them: ``reasons`` for people, ``reason_codes`` for programs."""
    texts = [reason.text for reason in reasons]
    return {"reasons": texts, "reason_codes": [reason.json() for reason in reasons]}


def published_reasons(reasons: Iterable[Reason]) -> dict[str, list[Any]]:
    """Return reasons as a daemon publishes them; `read_record` takes each of ``reason_codes``."""
    records = [reason.record() for reason in reasons]
    return {"reasons": [record["text"] for record in records], "reason_codes": records}


def remedies(reasons: Iterable[Reason]) -> list[str]:
    """Return what to do about some reasons, each thing once; the general advice only if alone."""
    advice = [
        WORDINGS[reason.code].remedy.format_map(_Phrases({}, VOCABULARIES[reason.scene]))
        for reason in reasons
    ]
    advice = [text for text in dict.fromkeys(advice) if text]
    return [text for text in advice if text != _LOOK] or advice


def summarize_reasons(reasons: Sequence[Reason]) -> str:
    """Return the sentence of reasons of one kind; their label where they are not all the same."""
    first = reasons[0]
    return first.text if all(reason == first for reason in reasons) else _label(first)


def _label(reason: Reason) -> str:
    """Return a reason's label, with what tells it from others of its code."""
    words = ", ".join(value for value in reason.values.values() if isinstance(value, str))
    return WORDINGS[reason.code].label + (f" ({words})" if words else "")


class _Number(float):
    """A number that knows how its unit is written: ``.1f mm`` of metres, ``more|less`` by sign."""

    def __format__(self, spec: str) -> str:
        if "|" in spec:
            return spec.split("|")[self <= 0.0]
        digits, _, unit = spec.partition(" ")
        return format(self * 1e3, digits) + f" {unit}" if unit else float.__format__(self, digits)


class _Phrases(dict[str, Any]):
    """What may stand in a sentence: values, words of the scene, and phrases made of both."""

    def __init__(self, values: Mapping[str, Any], words: Vocabulary) -> None:
        numbers = {n: _Number(v) for n, v in values.items() if isinstance(v, float)}
        super().__init__({**values, **numbers})
        self.words = words

    def __missing__(self, name: str) -> object:
        phrase = _PHRASES.get(name)
        return getattr(self.words, name) if phrase is None else phrase(self)


def _gate(found: Mapping[str, Any], words: Vocabulary) -> str:
    side = f"{found['side']} side, " if words.two_sides else ""
    return f"the gate on channel {found['channel']} ({side}{found['height_m'] * 1e3:g} mm)"


def _side(phrases: _Phrases) -> str:
    side = phrases.get("side")
    return f" on the {side} side" if side and phrases.words.two_sides else ""


def _chain(phrases: _Phrases) -> str:
    name = phrases["name"]
    if phrases.words.part != "rod":
        return phrases.words.body
    return f"chain {name}" if name else "each chain"


def _each_part(phrases: _Phrases) -> str:
    words = phrases.words
    if words.body.endswith(words.part):  # the object is its own only part
        return words.body
    return f"every {words.part} of {_chain(phrases)}"


def _measured(phrases: _Phrases, name: str) -> str:
    speed = phrases.get(f"{name}_m_s")
    value, unit = (phrases[f"{name}_m"], "mm") if speed is None else (speed, "m/s")
    return format_quantity(Quantity(float(value), float(phrases[f"{name}_U95"])), unit)


_LEAST_MM = 0.1
_PHRASES: dict[str, Callable[[_Phrases], str]] = {
    "gate": lambda p: _gate(p, p.words),
    "gates": lambda p: " and ".join(_gate(gate, p.words) for gate in p["at"]),
    "on_side": _side,
    "alone": lambda p: _measured(p, "alone"),
    "whole": lambda p: _measured(p, "whole"),
    "chain": _chain,
    "each_part": _each_part,
    "size": lambda p: f"{abs(p['size_m']) * 1e3:.1f} ± {max(p['U95_m'] * 1e3, _LEAST_MM):.1f} mm",
    "relative": lambda p: f"{abs(p['share']):.2%} ± {max(p['U95'], 1e-4):.2%}",
    "share_of_edges": lambda p: (
        f"{p['missed'] / p['expected']:.1%}"
        if "missed" in p
        else f"{p['unexplained'] / p['received']:.1%}"
    ),
    "faults": lambda p: "; or ".join(
        make_reason(fault["code"], p.words, **fault["values"]).text for fault in p["candidates"]
    ),
}


def _odds(log_odds: float) -> str:
    return f"{math.exp(log_odds):.0f}" if log_odds < math.log(1e4) else "more than 10,000"
