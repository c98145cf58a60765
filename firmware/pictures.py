"""Draws how each board is wired: `python firmware/pictures.py` writes an SVG beside each `board.h`.

Pins come from `board.h`; what is around them is one design for all boards, but that a Pico's pins
stand 3.3 V: the comparators' open outputs are pulled up to that, and MOSFETs open with it. A part
that not every scene needs has its name as an SVG class, so that `rig new` can leave it out.
"""

from __future__ import annotations

import sys
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Literal

sys.path.insert(0, str(Path(__file__).parents[1]))  # run as a script, it does not see its parent

import schemdraw
from schemdraw import drawing_stack
from schemdraw import elements as elm

from firmware.pins import Pins, read_pins

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

BOARDS = ("rp2040", "atmega2560", "atmega328p")
_INK, _QUIET, _PIN, _LIGHT = "#1b1f24", "#5b6670", "#0b5cad", "#c0392b"
_PAPER, _BOARD = "#ffffff", "#f2f6fa"
_FONT = "DejaVu Sans, Verdana, Arial, sans-serif"
_TEXT, _SMALL = 11, 9.5


class _Sheet(schemdraw.Drawing):
    """A drawing whose elements may bear the name of their part."""

    parts: dict[int, str]

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Name the part of all elements that are drawn meanwhile."""
        drawing_stack.push_element(None)  # the element before is placed only then
        begin = len(self.elements)
        yield
        drawing_stack.push_element(None)
        self.parts |= dict.fromkeys(range(begin, len(self.elements)), name)

    def svg(self) -> bytes:
        """Write the drawing, with parts as classes."""
        picture = self.draw(show=False)
        picture.svgelements.clear()
        for n, element in enumerate(self.elements):
            begin = len(picture.svgelements)
            element._draw(picture)
            for _, node in picture.svgelements[begin:]:
                if n in self.parts:
                    node.set("class", self.parts[n])
        return picture.getimage("svg")


def draw(pins: Pins, path: Path) -> None:
    """Draw a board's wiring.

    Parameters
    ----------
    pins
        Of the board.
    path
        The SVG file.
    """
    schemdraw.use("svg")
    with _Sheet(show=False) as page:
        page.parts = {}
        page.config(
            unit=2, fontsize=_TEXT, font=_FONT, color=_INK, lw=1.4, bgcolor=_PAPER, margin=0.4
        )
        _title(0, 15.4, f"{pins.board}: what goes to its pins", 17)
        _board(page, pins, 0, 14.2)
        _gate(pins, 8.4, 9.4)
        _release(page, pins, 7.6, 1.5)
        _holding_release(pins, 17.0, 1.5)
        _stop(pins, 0.6, -5.5)
        with page.part("reference"):
            _reference(pins, 7.6, -5.5)
        with page.part("sync"):
            _sync(pins, 14.6, -5.5)
        if "SENSE" in pins.others:
            with page.part("sense"):
                _sense(pins, 21.4, -5.5)
        if not pins.led_on_board:
            _status(pins, 0, -0.2)
    path.write_bytes(page.svg())


def _text(
    x: float,
    y: float,
    text: str,
    size: float = _SMALL,
    *,
    align: Literal["left", "center", "right"] = "left",
    color: str = _INK,
) -> None:
    # Without a direction of its own, a label would take that of whatever was drawn before it.
    elm.Label().right().at((x, y)).label(
        text, loc="center", fontsize=size, halign=align, valign="center", color=color, ofst=0
    )


def _title(x: float, y: float, text: str, size: float = 13) -> None:
    _text(x, y, text, size)


def _note(x: float, y: float, *lines: str) -> None:
    for n, line in enumerate(lines):
        _text(x, y - 0.46 * n, line, color=_QUIET)


def _supply(x: float, y: float, volts: str = "+5 V") -> None:
    elm.Vdd().at((x, y)).label(volts, fontsize=_SMALL)


def _ground(x: float, y: float) -> None:
    elm.Ground().at((x, y))


def _wire(*points: tuple[float, float]) -> None:
    for start, end in pairwise(points):
        elm.Line().at(start).to(end)


def _down(
    part: elm.Element2Term, x: float, top: float, bottom: float, text: str, loc: str = "bottom"
) -> elm.Element2Term:
    return part.at((x, top)).to((x, bottom)).label(text, loc=loc, fontsize=_SMALL)


def _pin(x: float, y: float, name: str, *, left: bool = False) -> None:
    """Draw a pin of the board as a flag; `left`: the wire leaves it to the right."""
    flag = elm.Tag(width=1.5, height=0.62).at((x, y)).color(_PIN)
    (flag.left() if left else flag.right()).label(name, fontsize=_TEXT, color=_PIN)


def _board(page: _Sheet, pins: Pins, x: float, y: float) -> None:
    """Draw the board as the list of its pins."""
    rows = [(pin, f"gate {n}") for n, pin in enumerate(pins.gates)]
    words = {
        "RELEASE_0": "release 0",
        "RELEASE_1": "release 1",
        "SYNC": "sync out",
        "STOP": "emergency stop",
        "SENSE": "release sense",
        "REFERENCE": "1 Hz reference",
        "LED": "status LED (on board)" if pins.led_on_board else "status LED",
    }
    rows += [(pins.others[key][0], word) for key, word in words.items() if key in pins.others]
    if pins.volts != "+5 V":
        rows += [("3V3", "out: pull-ups")]
    rows += [("GND", "all grounds")]
    parts = {words[key]: key.lower() for key in ("SYNC", "SENSE", "REFERENCE")}
    step = 0.5
    box = elm.Rect(corner1=(0, 0.45), corner2=(5.6, 0.05 - step * len(rows)))
    box.at((x, y)).fill(_BOARD).color(_QUIET)
    for n, (pin, word) in enumerate(rows):
        at = y - step * n
        with page.part(parts.get(word, word.replace(" ", "-"))):
            _text(x + 1.3, at, pin, _TEXT, align="right", color=_PIN)
            _text(x + 1.7, at, word, _TEXT)


def _gate(pins: Pins, x: float, y: float) -> None:
    _title(x - 0.8, y + 4.9, "Photogate, the same for each gate: high while its beam is blocked")
    _supply(x + 0.6, y + 3.6)
    _down(elm.ResistorVar(), x + 0.6, y + 3.6, y + 1.8, "68 Ω +\ntrimmer\n2 kΩ", "top")
    _down(elm.LED(), x + 0.6, y + 1.8, y, "IR LED\n940 nm", "top")
    _ground(x + 0.6, y)
    beam = elm.Line(arrow="->").at((x + 2.1, y + 2.6)).to((x + 3.2, y + 2.6))
    beam.color(_LIGHT).linestyle("--")
    _text(x + 2.65, y + 2.95, "beam", align="center", color=_LIGHT)

    eye = elm.NpnPhoto().at((x + 4.0, y + 2.6)).anchor("base")
    node_x, node_y = eye.collector.x, y + 1.8
    _supply(node_x, y + 3.6)
    _wire((node_x, y + 3.6), (node_x, eye.collector.y))
    _wire((node_x, eye.emitter.y), (node_x, node_y))
    _down(elm.Resistor(), node_x, node_y, y, "4.7 kΩ", "top")
    _ground(node_x, y)
    elm.Dot().at((node_x, node_y))
    _note(node_x + 0.4, y + 2.9, "slit 0.5 mm", "in front")
    _note(node_x + 0.4, y + 1.4, "trim to 2.44 V")

    chip = elm.Opamp(leads=True).right().at((node_x + 4.8, node_y)).anchor("in1")
    _text(chip.center.x - 0.05, chip.center.y, "½ LM393", _SMALL - 1.5, align="center")
    _wire((node_x, node_y), (chip.in1.x, node_y))
    ref_x, ref_y = chip.in2.x - 1.4, chip.in2.y
    _wire((ref_x, ref_y), (chip.in2.x, ref_y))
    elm.Dot().at((ref_x, ref_y))
    # Its upper resistor crosses the signal's wire without touching it.
    _down(elm.Resistor(), ref_x, y + 3.6, y + 2.0, "33 kΩ", "top")
    _wire((ref_x, y + 2.0), (ref_x, ref_y))
    _supply(ref_x, y + 3.6)
    _down(elm.Resistor(), ref_x, ref_y, ref_y - 1.7, "10 kΩ", "top")
    _ground(ref_x, ref_y - 1.7)

    out_x, out_y = chip.out.x + 0.5, chip.out.y
    _wire((chip.out.x, out_y), (out_x + 0.9, out_y))
    elm.Dot().at((out_x, out_y))
    _supply(out_x, y + 3.6, pins.volts)
    _down(elm.Resistor(), out_x, y + 3.6, y + 2.0, "2.2 kΩ")
    _wire((out_x, y + 2.0), (out_x, out_y))
    back_y = ref_y - 1.1
    _wire((out_x, out_y), (out_x, back_y))
    elm.Resistor().at((chip.in2.x - 0.4, back_y)).to((out_x, back_y)).label(
        "220 kΩ", loc="top", fontsize=_SMALL
    )
    _wire((chip.in2.x - 0.4, back_y), (chip.in2.x - 0.4, ref_y))
    elm.Dot().at((chip.in2.x - 0.4, ref_y))

    end = out_x + 0.9
    elm.Resistor().at((end, out_y)).to((end + 1.7, out_y)).label("1 kΩ", fontsize=_SMALL)
    _pin(end + 1.7, out_y, pins.gates[0])
    _note(
        x + 10.6,
        y - 1.35,
        "2.2 kΩ and 1 kΩ beside the pin; 100 nF at each chip.",
        f"{pins.gates[0]} is gate 0; the list has the pins of the other gates.",
        "Leave a pin without a gate open.",
    )


def _listed(names: tuple[str, ...]) -> str:
    return f"{', '.join(names[:3])} … {names[-1]}"


def _switch(x: float, y: float, name: str, other: str) -> tuple[float, float, float]:
    """Draw pin, resistors and MOSFET; return the drain's place and the source's height."""
    _pin(x + 1.6, y, name, left=True)
    elm.Resistor().at((x + 1.6, y)).to((x + 3.2, y)).label("100 Ω", fontsize=_SMALL)
    elm.Dot().at((x + 3.2, y))
    _down(elm.Resistor(), x + 3.2, y, y - 1.7, "10 kΩ", "top")
    _ground(x + 3.2, y - 1.7)
    fet = elm.NFet().theta(0).reverse().at((x + 4.0, y)).anchor("gate")
    _wire((x + 3.2, y), (x + 4.0, y))
    _wire((fet.source.x, fet.source.y), (fet.source.x, y - 1.7))
    _ground(fet.source.x, y - 1.7)
    _text(fet.source.x + 0.3, y, other)
    return fet.drain.x, fet.drain.y, fet.source.y


def _first_fet(pins: Pins, at_5_volts: str) -> str:
    """Name the MOSFET at a pin: those that are sure to open with 3.3 V are others."""
    return (
        at_5_volts
        if pins.volts == "+5 V"
        else {"IRLZ44N": "AO3400A", "2N7000": "BSS138"}[at_5_volts]
    )


def _release(page: _Sheet, pins: Pins, x: float, y: float) -> None:
    _title(x, y + 4.9, "Release, magnet that lets go with current")
    drain_x, drain_y, _ = _switch(
        x, y + 0.6, pins.others["RELEASE_0"][0], _first_fet(pins, "IRLZ44N")
    )
    top = y + 3.6
    _supply(drain_x, top, "+12 V")
    _down(elm.Inductor2(loops=3), drain_x, top - 0.2, top - 1.7, "magnet", "top")
    _wire((drain_x, top), (drain_x, top - 0.2))
    _wire((drain_x, top - 1.7), (drain_x, drain_y))
    for at in (top - 0.2, top - 1.7):
        elm.Dot().at((drain_x, at))
        _wire((drain_x, at), (drain_x + 1.3, at))
    elm.Diode().at((drain_x + 1.3, top - 1.7)).to((drain_x + 1.3, top - 0.2)).label(
        "1N4007", loc="bottom", fontsize=_SMALL
    )
    with page.part("release-1"):
        _note(x, y - 2.2, f"Release 1, at {pins.others['RELEASE_1'][0]}, is the same.")


def _holding_release(pins: Pins, x: float, y: float) -> None:
    _title(x, y + 4.9, "Release, magnet that holds with current")
    first_x, first_y, _ = _switch(
        x, y + 0.6, pins.others["RELEASE_0"][0], _first_fet(pins, "2N7000")
    )
    top = y + 3.6
    joint = y + 1.6
    _supply(first_x, top, "+12 V")
    _down(elm.Resistor(), first_x, top, joint, "2.2 kΩ", "top")
    _wire((first_x, joint), (first_x, first_y))
    elm.Dot().at((first_x, joint))
    fet = elm.NFet().theta(0).reverse().at((first_x + 1.6, joint)).anchor("gate")
    _wire((first_x, joint), (first_x + 1.6, joint))
    _wire((fet.source.x, fet.source.y), (fet.source.x, y - 1.1))
    _ground(fet.source.x, y - 1.1)
    _text(fet.source.x + 0.3, joint, "IRLZ44N")
    drain_x = fet.drain.x
    _supply(drain_x, top + 0.4, "+12 V")
    low = fet.drain.y
    _down(elm.Inductor2(loops=3), drain_x, top + 0.2, low, "magnet", "top")
    _wire((drain_x, top + 0.4), (drain_x, top + 0.2))
    side = drain_x + 1.5
    for at in (top + 0.2, low):
        elm.Dot().at((drain_x, at))
        _wire((drain_x, at), (side, at))
    middle = (low + top + 0.2) / 2
    elm.Diode().at((side, low)).to((side, middle)).label("1N4007", loc="bottom", fontsize=_SMALL)
    zener = elm.Zener().at((side, top + 0.2)).to((side, middle))
    zener.label("24 V, 5 W", loc="bottom", fontsize=_SMALL)
    _note(
        x,
        y - 2.2,
        "The pulse switches the magnet off; the Zener diode lets its current die fast.",
        "Without power it releases.",
    )


def _input(x: float, y: float, name: str, ohms: str) -> tuple[float, float]:
    """Draw a series resistor into a pin on the right; return where it begins."""
    elm.Resistor().at((x, y)).to((x + 1.7, y)).label(ohms, fontsize=_SMALL)
    _pin(x + 1.7, y, name)
    return x, y


def _contact(
    pins: Pins, x: float, y: float, key: str, contact: Callable[[], elm.Element2Term], text: str
) -> None:
    """Draw a contact to ground, with its pull-up, at a pin. `contact` makes the symbol."""
    _supply(x + 1.8, y + 2.4, pins.volts)
    _down(elm.Resistor(), x + 1.8, y + 2.4, y + 0.8, "4.7 kΩ")
    _wire((x + 0.3, y + 0.8), (x + 2.6, y + 0.8))
    elm.Dot().at((x + 1.8, y + 0.8))
    _down(contact(), x + 0.3, y + 0.8, y - 0.9, text, "bottom")
    _ground(x + 0.3, y - 0.9)
    _input(x + 2.6, y + 0.8, pins.others[key][0], "1 kΩ")


def _stop(pins: Pins, x: float, y: float) -> None:
    _title(x - 0.6, y + 3.7, "Emergency stop")
    _contact(pins, x, y, "STOP", lambda: elm.Button(nc=True), "opens when\npressed")
    elm.Dot().at((x + 2.6, y + 0.8))
    _down(elm.Capacitor(), x + 2.6, y + 0.8, y - 0.9, "47 nF")
    _ground(x + 2.6, y - 0.9)
    _note(x - 0.6, y - 2.0, "Open, or a broken wire, means stop.")


def _reference(pins: Pins, x: float, y: float) -> None:
    _title(x, y + 3.7, "1 Hz reference")
    elm.Rect(corner1=(0, 0), corner2=(2.2, 1.8)).right().at((x, y - 0.1)).color(_QUIET)
    _text(x + 1.1, y + 1.05, "GPS", _TEXT, align="center")
    _text(x + 1.1, y + 0.55, "receiver", _TEXT, align="center")
    _text(x + 2.6, y + 1.1, "PPS", align="center")
    _wire((x + 2.2, y + 0.8), (x + 3.0, y + 0.8))
    _input(x + 3.0, y + 0.8, pins.others["REFERENCE"][0], "1 kΩ")
    _wire((x + 1.1, y - 0.1), (x + 1.1, y - 0.9))
    _ground(x + 1.1, y - 0.9)
    which = "5 V or 3.3 V" if pins.volts == "+5 V" else "3.3 V, never 5 V"
    _note(x, y - 2.0, f"Its rising edge counts; {which}.")


def _sync(pins: Pins, x: float, y: float) -> None:
    _title(x, y + 3.7, "Sync out, for a camera")
    _pin(x + 1.6, y + 0.8, pins.others["SYNC"][0], left=True)
    _wire((x + 1.6, y + 0.8), (x + 2.2, y + 0.8))
    elm.Dot().at((x + 2.2, y + 0.8))
    elm.Resistor().at((x + 2.2, y + 0.8)).to((x + 4.0, y + 0.8)).label("470 Ω", fontsize=_SMALL)
    _down(elm.LED(), x + 4.0, y + 0.8, y - 0.9, "red LED,\nin view", "bottom")
    _ground(x + 4.0, y - 0.9)
    _wire((x + 2.2, y + 0.8), (x + 2.2, y + 2.0), (x + 2.6, y + 2.0))
    elm.Resistor().at((x + 2.6, y + 2.0)).to((x + 4.0, y + 2.0)).label("1 kΩ", fontsize=_SMALL)
    _text(x + 4.2, y + 2.0, "trigger")
    _note(x, y - 2.0, "High from FIRE until the recording ends.")


def _sense(pins: Pins, x: float, y: float) -> None:
    _title(x, y + 3.7, "Release sense")
    _contact(pins, x + 0.6, y, "SENSE", elm.Switch, "the chain's\nhook closes it")
    _note(x, y - 2.0, "The first change after FIRE is stamped.")


def _status(pins: Pins, x: float, y: float) -> None:
    _pin(x + 1.5, y, pins.others["LED"][0], left=True)
    elm.Resistor().at((x + 1.5, y)).to((x + 3.2, y)).label("1 kΩ", fontsize=_SMALL)
    elm.LED().at((x + 3.2, y)).to((x + 5.0, y))
    _ground(x + 5.0, y)
    _text(x + 4.1, y - 0.8, "status", align="center")


def main() -> None:
    """Draw all boards."""
    folder = Path(__file__).parent
    for board in BOARDS:
        draw(read_pins(board), folder / board / "wiring.svg")


if __name__ == "__main__":
    main()
