"""The open data set of falling rod chains: sealed sessions, the truth apart, and a scorer.

An entrant states a value and an interval for each drop, or nothing. Those that state no interval
get the usual one of a teaching laboratory: twice the standard deviation of repeats.
"""

from __future__ import annotations

import csv
from collections import defaultdict
from pathlib import Path
from statistics import fmean, stdev
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from bench.studies.baselines import TimerReading, line_fit, two_gate_timer
from bench.studies.falls import with_settings
from bench.studies.sessions import SESSION, SimulatedSession, with_device
from rig.analysis.result import GOOD
from rig.bench.findings import Findings
from rig.bundle.archive import list_hashes, pack, to_json
from rig.bundle.tables import data_package
from rig.commands.bundling import derive_bundle
from rig.commands.output import say
from rig.errors import InputError
from rig.files import make_folder, replacing
from rig.ports import truth_file
from rig.ready import ready_protocol
from rig.text_table import csv_text, text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterable, Iterator, Mapping

    Row = Mapping[str, Any]

PROTOCOLS = ("inclined-uniform", "inclined-uniform-uno", "graded-chain", "single-chain")
"""Chains, inclines and layouts of gates."""
STRINGS = {"dead": 0.1, "usual": 0.3, "lively": 0.7}
"""With what share of its speed a string's jerk throws rods back."""
QUANTITIES = ("separation_m", "speed_m_s")
ALPHA = 0.05
_KEY = ("session", "run", "attempt")
_HEAD = """\
# Falling chains: who reads them how well

`./run bench dataset --repeats {repeats}{only}`: {drops} drops of the resolved world, read by each.
The interval score is the width of a 95 % interval plus 40 times what the truth lies outside of it
(Gneiting and Raftery, 2007, Eq. 43): smaller is better. Who states no interval gets twice the
standard deviation of repeats. Void: no interval."""
_README = """\
# Falling rod chains: simulated sessions with hidden truth

Licence: CC-BY-4.0 (https://creativecommons.org/licenses/by/4.0/). Made by chainrig; nothing fell.
Please cite J. Pantaleone, arXiv:2207.02692 (2022), whose experiment is simulated here.

- `sessions/NAME.eln`: what a laboratory would have, an RO-Crate each with session, edges as CSV,
  protocol and report; `rig verify` checks it. NAME is the protocol and the kind of strings.
- `truth/truth.csv`: what is true of each drop; `truth/NAME.jsonl`: the same with all that moved.
  Leave this folder closed until your analysis is done.
- `readings.csv`: what the entrants read; add rows of your own and score them with
  `./run bench dataset -o FOLDER --score readings.csv`.
- `datapackage.json` describes the columns, `SHA256SUMS` has a hash of every file.

Rods swing, turn, touch each other and hang on strings: no formula of the model is used.
"""
_MEANINGS = {
    "session": "name of the session",
    "incline_deg": "inclination of the board",
    "separation_m": "height of the free chain's top rod over the other's as that one passes the "
    "contact level, as of simultaneous release",
    "separation_raw_m": "the same as it happened",
    "speed_m_s": "speed of the impact chain's top rod then",
    "release_skew_s": "release of the free chain less that of the impact chain",
    "entrant": "who read it",
    "quantity": "column of truth.csv",
    "value": "the reading, SI units; empty where void",
    "U95": "half of its 95 % interval; empty where none is stated",
}


def run(arguments: Namespace) -> Iterator[Findings]:
    """Make the data set and hold all entrants against its truth, or score readings of others."""
    folder = make_folder(Path(arguments.output) / "falling-chains")
    if arguments.score is None:
        truths, readings = _make(folder, arguments.repeats, arguments.only)
    else:
        truths, readings = _read(folder / "truth/truth.csv"), _read(Path(arguments.score))
    rows = scores(truths, readings)
    only = f" --only {arguments.only}" if arguments.only else ""
    head = _HEAD.format(repeats=arguments.repeats, only=only, drops=len(truths))
    cells = [["entrant", "quantity", "drops", "void", "coverage", "interval score (mm, mm/s)"]]
    cells += [
        [row["entrant"], row["quantity"], str(row["drops"]), f"{row['void']:.0%}",
         *(f"{row[name] * scale:.3g}{unit}" if row[name] is not None else "–"
           for name, scale, unit in (("coverage", 100, " %"), ("interval_score", 1e3, "")))]
        for row in rows
    ]  # fmt: skip
    table = text_table(cells, left={0, 1}, rule=True)
    yield Findings({"scores": rows}, table, head, rows, simulated=True)


def _read(path: Path) -> list[Row]:
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            rows: list[Row] = [
                {key: _value(key, cell) for key, cell in row.items()}
                for row in csv.DictReader(stream)
            ]
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read {path}: {error}", "see README.md of the data set") from error
    return rows


def _value(column: str, cell: str) -> Any:
    if column in {"session", "entrant", "quantity"}:
        return cell
    return int(cell) if column in _KEY else float(cell) if cell else None


def _make(folder: Path, repeats: int, only: str) -> tuple[list[Row], list[Row]]:
    truths: list[Row] = []
    readings: list[Row] = []
    files: dict[str, bytes] = {"README.md": _README.encode()}
    cases = [(protocol, strings) for protocol in PROTOCOLS for strings in STRINGS]
    for seed, (protocol, strings) in enumerate(cases, 1):
        name = f"{protocol}-{strings}"
        if only not in name:
            continue
        say(f"{name}: simulating and reading")
        dials = {"dynamics": "resolved", "string_restitution": str(STRINGS[strings])}
        url = with_settings("sim://", dials)
        with TemporaryDirectory() as place:
            session = with_device(Path(place), str(ready_protocol(protocol)), url, seed, repeats)
            path = Path(place) / SESSION
            files[f"sessions/{name}.eln"] = pack(derive_bundle(path.read_bytes()).files)
            files[f"truth/{name}.jsonl"] = truth_file(path).read_bytes()
        readings += _entrants(name, session)
        truths += [
            {"session": name, **{key: fall.truth.get(key) for key in _columns()}}
            for fall, _ in session.drops.values()
        ]
    tables = {
        "truth/truth.csv": csv_text(truths),
        "readings.csv": csv_text(readings, ["entrant", *_KEY, "quantity", "value", "U95"]),
    }
    package = data_package(tables)
    for field in (field for part in package["resources"] for field in part["schema"]["fields"]):
        field["description"] = _MEANINGS.get(field["name"], field.get("description", ""))
    package |= {"name": "falling-chains", "licenses": [{"name": "CC-BY-4.0"}]}
    files |= {name: text.encode() for name, text in tables.items()}
    for name, content in list_hashes({**files, "datapackage.json": to_json(package)}).items():
        make_folder((folder / name).parent)
        with replacing(folder / name) as stream:
            stream.write(content)
    return truths, readings


def _columns() -> list[str]:
    named = [name for name in _MEANINGS if name.endswith(("_deg", "_m", "_m_s", "_s"))]
    return [*_KEY[1:], *named]


def _entrants(name: str, session: SimulatedSession) -> Iterator[Row]:
    """Yield what each entrant reads of each drop; ours states its own interval."""
    protocol = session.protocol
    groups: dict[tuple[object, ...], list[dict[str, Any]]] = defaultdict(list)
    for result, (_, drop, truth), scale in session.results():
        job, hz = (drop.run, drop.attempt), float(scale.hz)
        simple: dict[str, TimerReading | None] = {}
        if protocol.two_chains:
            simple = {
                "camera, 480 fps": _camera(truth),
                "last passages": line_fit(protocol, drop, hz),
                "two-gate timer": two_gate_timer(protocol, drop, hz),
            }
        for quantity in QUANTITIES:
            if truth.get(quantity) is None:
                continue
            row = {**dict(zip(_KEY, (name, *job), strict=True)), "quantity": quantity}
            own = result.quantities.get(quantity) if result.verdict in GOOD else None
            numbers = (own.value, own.expanded) if own else (None, None)
            yield {"entrant": "chainrig", **row, "value": numbers[0], "U95": numbers[1]}
            # These know no release times: how late one was is given to them.
            late = truth["separation_raw_m"] - truth[quantity] if quantity == QUANTITIES[0] else 0.0
            for entrant, reading in simple.items():
                value = None if reading is None else getattr(reading, quantity) - late
                groups[entrant, quantity, result.run.incline_deg].append(
                    {"entrant": entrant, **row, "value": value}
                )
    for rows in groups.values():
        values = [row["value"] for row in rows if row["value"] is not None]
        scatter = 2.0 * stdev(values) if len(values) > 1 else None
        yield from ({**row, "U95": scatter if row["value"] is not None else None} for row in rows)


def _camera(truth: Row) -> TimerReading:
    return TimerReading(truth["camera_separation_m"], truth["camera_speed_m_s"])


def scores(truths: Iterable[Row], readings: Iterable[Row]) -> list[dict[str, Any]]:
    """Hold readings against the truth.

    Returns
    -------
    list of dict
        By entrant and quantity: number of drops, share of void ones, and of the others the share
        of intervals with the truth and the mean interval score (Gneiting and Raftery, 2007).
    """
    true = {tuple(row[key] for key in _KEY): row for row in truths}
    read: dict[tuple[str, str], list[float | None]] = defaultdict(list)
    held: dict[tuple[str, str], list[bool]] = defaultdict(list)
    for row in readings:
        key = row["entrant"], row["quantity"]
        truth = true[tuple(row[name] for name in _KEY)][row["quantity"]]
        if row["value"] is None or row["U95"] is None:
            read[key].append(None)
            continue
        outside = max(0.0, abs(row["value"] - truth) - row["U95"])
        read[key].append(2.0 * row["U95"] + 2.0 / ALPHA * outside)
        held[key].append(outside == 0.0)
    rows = []
    for (entrant, quantity), values in sorted(read.items()):
        stated = [value for value in values if value is not None]
        rows.append({
            "entrant": entrant,
            "quantity": quantity,
            "drops": len(values),
            "void": 1.0 - len(stated) / len(values),
            "coverage": fmean(held[entrant, quantity]) if stated else None,
            "interval_score": fmean(stated) if stated else None,
        })  # fmt: skip
    return rows
