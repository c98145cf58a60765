"""One known truth, written as the programs of many makers write it."""

from __future__ import annotations

import bisect
import itertools
import json
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

PROTOCOL = Path(__file__).parents[2] / "protocols" / "falling-ball.yaml"
HEIGHTS = {0: 0.850, 1: 0.600, 2: 0.350, 3: 0.100}
DROP, GRAVITY, WIDTH = 0.900, 9.81, 0.020
RELEASES = (0.31, 0.28, 0.35)
Truth = list[tuple[float, int, bool]]


def run(release: float) -> Truth:
    """Return time, s, channel and whether it gets dark, of a ball past four gates."""
    edges = [
        (release + (2 * (DROP - height + sign * WIDTH / 2) / GRAVITY) ** 0.5, channel, sign < 0)
        for channel, height in HEIGHTS.items()
        for sign in (-1, 1)
    ]
    return sorted((round(time, 6), channel, dark) for time, channel, dark in edges)


RUNS = [run(release) for release in RELEASES]


@dataclass(frozen=True)
class Shape:
    """A file and what it says.

    Where samples are `bare`, with neither times nor numbers, a missing row shifts all below it.
    """

    content: bytes
    truth: list[Truth]
    sampled: float = 0.0
    options: tuple[str, ...] = ()
    bare: bool = False


def text(content: str, runs=1, encoding="utf-8", **more) -> Shape:
    return Shape(content.encode(encoding), RUNS[:runs], **more)


def by_gate(edges: Truth) -> dict[int, Truth]:
    return {n: [edge for edge in edges if edge[1] == n] for n in HEIGHTS}


def table(rows, separator=",") -> str:
    return "".join(separator.join(map(str, row)) + "\n" for row in rows)


def beside(heading, separator=",", comma=False) -> str:
    """Write all runs side by side, a time and a column of states for each gate."""
    rows = [separator.join(heading(n) for n in (1, 2, 3))]
    for three in zip(*RUNS, strict=True):
        cells = []
        for time, channel, dark in three:
            cells.append(f"{time:.6f}")
            cells += [str(int(dark)) if n == channel else "" for n in HEIGHTS]
        rows.append(separator.join(cells))
    out = "\n".join(rows) + "\n"
    return out.replace(".", ",") if comma else out


def levels(edges: Truth, time: float) -> list[int]:
    return [
        int(any(dark for t, c, dark in edges[: bisect.bisect_right(edges, (time + 1e-9, 9, True))]
                if c == n) and [d for t, c, d in edges if c == n and t <= time + 1e-9][-1])
        for n in HEIGHTS
    ]  # fmt: skip


LEVELS = table([f"{t:.6f}", *levels(RUNS[0], t)] for t, _, _ in RUNS[0])
"""Time and the state of each gate, at each edge of the first run."""

STEP = 2e-4
TIMES = 0.35 + STEP * np.arange(2000)
"""Moments, s, of samples: from before the first edge of the first run until after its last."""


def volts(edges: Truth, gates, bright=4.6, dark_v=0.2):
    columns = []
    for n in gates:
        value = np.full(TIMES.size, bright)
        for t, channel, dark in edges:
            if channel == n:
                share = np.clip((TIMES - t) / 0.2e-3 + 0.5, 0, 1)
                value += (dark_v - bright if dark else bright - dark_v) * share
        columns.append(value + 0.03 * np.sin(300 * TIMES + n))
    return np.array(columns).T


def scope(head: str, row, gates=tuple(HEIGHTS), runs=1, encoding="utf-8", **more) -> Shape:
    body = "".join(map(row, itertools.count(), TIMES, volts(RUNS[0], gates)))
    truth = [[edge for edge in RUNS[0] if edge[1] in gates]]
    return Shape((head + body).encode(encoding), truth, sampled=STEP, **more)


def csv(k, t, v, form="{:.6e}"):
    return ",".join([f"{t:.7e}", *(form.format(x) for x in v)]) + "\n"


def vcd(edges: Truth) -> str:
    marks = "!#$%"
    head = "$date today $end\n$version PulseView 0.4.2 $end\n$timescale 1 us $end\n"
    head += "$scope module m $end\n"
    wires = "".join(f"$var wire 1 {marks[n]} D{n} $end\n" for n in HEIGHTS)
    zero = "#0\n" + "".join(f"0{mark}\n" for mark in marks)
    changes = "".join(f"#{round(t * 1e6)}\n{int(d)}{marks[c]}\n" for t, c, d in edges)
    return f"{head}{wires}$upscope $end\n$enddefinitions $end\n{zero}{changes}"


PLACES = ("top", "upper", "lower", "bottom")
ROWS = json.loads(Path(__file__).with_name("rows.json").read_text("utf-8"))
"""Whole files and how many runs they have; what stands above, a row, words for blocked and clear,
how many runs, what is below, marks; of scopes what stands above, a row, how a value is written,
what parts them, whether they are bare."""


def write(form: str, words: str = "", runs=RUNS[:1], mark: str = "") -> str:
    """Write a row for each edge, below a mark of each run; capitals have decimal commas."""
    blocked, clear = words.split() or ("1", "0")
    rows, k = [], 0
    for n, edges in enumerate(runs, 1):
        rows.append(mark.format(n))
        for t, c, dark in edges:
            s, ms, k = f"{t:.6f}", f"{t * 1e3:.3f}", k + 1
            values = {"s": s, "ms": ms, "S": s.replace(".", ","), "MS": ms.replace(".", ",")}
            values |= {"us": round(t * 1e6), "coarse": f"{t * 1e3:.0f}", "d": int(dark)}
            values |= {"no": int(not dark), "w": blocked if dark else clear}
            values |= {"next": c + 1, "letter": "ABCD"[c], "place": PLACES[c]}
            rows.append(form.format(n=n, k=k, c=c, **values))
    return "".join(rows)


def from_rows(group: str) -> dict[str, Shape]:
    """Return the files of a group of `ROWS`."""
    return {
        name: text(head + write(form, words, RUNS[:runs], mark) + tail, runs)
        for name, (head, form, words, runs, tail, mark) in ROWS[group].items()
    }


def scope_of(head: str, form: str, value: str, separator: str, bare: bool) -> Shape:
    def row(k, t, v):
        values = separator.join(map(value.format, v))
        return form.format(k=k, t=t, ms=t * 1e3, v=values)

    return scope(head, row, bare=bare)


def from_scopes(group: str) -> dict[str, Shape]:
    return {name: scope_of(*row) for name, row in ROWS[group].items()}


@cache
def shapes() -> dict[str, Shape]:
    """Return every shape by its name."""
    found = from_rows("shapes") | from_scopes("scopes")
    found |= {name: text(content, runs) for name, (content, runs) in ROWS["files"].items()}
    found["cp1252"] = text(found["cp1252"].content.decode(), encoding="cp1252")

    def states(n):
        return ",".join([f"Run {n}: Time (s)", *(f"Run {n}: Gate {g} State ()" for g in HEIGHTS)])

    found["Logger Pro, runs side by side"] = text(beside(states), 3)
    found["Graphical Analysis"] = text("\ufeff" + beside(
        lambda n: states(n).replace("Run 3", "Latest")), 3)  # fmt: skip
    found["Capstone times blocked"] = Shape(
        (",".join(f'"Time Blocked, Ch {g} (s) Run #{n}"' for n in (1, 2, 3) for g in HEIGHTS) + "\n"
         + ",".join(f"{next(t for t, c, d in RUNS[n] if c == g and d):.6f}"
                    for n in range(3) for g in HEIGHTS) + "\n").encode(),
        [[e for e in edges if e[2]] for edges in RUNS])  # fmt: skip
    found["Capstone states"] = text(
        ",".join(f'"Time (s) Run #{n}",' + ",".join(f'"State, Ch {g} Run #{n}"' for g in HEIGHTS)
                 for n in (1, 2, 3)) + "\n"
        + table([cell for t, c, d in three
                 for cell in (f"{t:.6f}", *(int(d) if g == c else "" for g in HEIGHTS))]
                for three in zip(*RUNS, strict=True)), 3)  # fmt: skip
    found["SPARKvue"] = text(
        '"Time (s)","Gate 0 State (Blocked/Unblocked)",'
        '"Gate 1 State","Gate 2 State","Gate 3 State"\n' + LEVELS
    )
    found["Vernier Format 2"] = text("".join(
        f"Vernier Format 2\nfall.cmbl\nRun {n}\nTime\tGate 0\tGate 1\tGate 2\tGate 3\n"
        "t\tG0\tG1\tG2\tG3\ns\t\t\t\t\n\n"
        + table(
            ([f"{t:.6f}", *(int(d) if g == c else "" for g in HEIGHTS)] for t, c, d in edges), "\t"
        )
        for n, edges in enumerate(RUNS, 1)), 3)  # fmt: skip

    by_one_clock = [[(t + 10 * n, c, d) for t, c, d in edges] for n, edges in enumerate(RUNS)]
    for name, mark in (("with", "--- Run {} ---\n"), ("without", "")):
        lines = write("{c},{us},{d}\n", runs=by_one_clock, mark=mark)
        found[f"Arduino {name} marks"] = text("Gate,Micros,State\n" + lines, 3)
    found["OWON in microseconds"] = scope(
        "Channel\t\t:,CH1,CH2,CH3,CH4\nFrequency\t:,F=?,F=?,F=?,F=?\n"
        "Vertical pos\t:,0.00mV,0.00mV,0.00mV,0.00mV\nTime interval\t:,200.00uS\n\n"
        "index,CH1_Voltage(mV),CH2_Voltage(mV),CH3_Voltage(mV),CH4_Voltage(mV)\n",
        lambda k, t, v: f"{k}," + ",".join(f"{x * 1e3:.2f}" for x in v) + "\n",
    )
    found["Tektronix, digital, head marked"] = Shape((
        "#Model,MDO3014\n#Firmware Version,1.26\n#\n#Waveform Type,DIGITAL,,,\n#Point Format,Y,,,\n"
        "#Horizontal Units,s,,,\n#Sample Interval,2e-04,,,\n#Record Length,2000,,,\n#,,,,\n"
        "#Vertical Units,V,V,V,V\n#Label,,,,\nTIME,D0,D1,D2,D3\n"
        + "".join(f"{t:.4e}," + ",".join(map(str, levels(RUNS[0], t))) + "\n"
                  for t in TIMES)).encode(), RUNS[:1], sampled=STEP)  # fmt: skip
    lvm = (
        "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\n"
        "Decimal_Separator\t{}\nMulti_Headings\tNo\nX_Columns\t{}\nTime_Pref\tRelative\n"
        "***End_of_Header***\t\n\t\nChannels\t4\t\t\t\t\nSamples\t2000\t2000\t2000\t2000\t\n"
        "Y_Unit_Label\tVolts\tVolts\tVolts\tVolts\t\nX_Dimension\tTime\tTime\tTime\tTime\t\n"
        "X0\t0.0\t0.0\t0.0\t0.0\t\nDelta_X\t2.0E-4\t2.0E-4\t2.0E-4\t2.0E-4\t\n"
        "***End_of_Header***\t\t\t\t\t\nX_Value\tGate 0\tGate 1\tGate 2\tGate 3\tComment\n"
    )
    for name, encoding in (("with", "utf-16"), ("without", "utf-16-le")):
        found[f"LabVIEW in UTF-16 {name} its mark"] = scope(
            lvm.format(".", "One"),
            lambda k, t, v: "\t".join([f"{t:.6f}", *(f"{x:.6f}" for x in v)]) + "\t\n",
            encoding=encoding,
        )
    found["LabVIEW, comments without a cell"] = scope(
        lvm.format(".", "One"), lambda k, t, v: "\t".join(f"{x:.6f}" for x in (t, *v)) + "\n"
    )
    found["LabVIEW without times"] = scope(
        lvm.format(".", "No"),
        lambda k, t, v: "\t".join(["", *(f"{x:.6f}" for x in v)]) + "\t\n",
        bare=True,
    )
    found["Saleae"] = text("Time [s],Channel 0,Channel 1,Channel 2,Channel 3\n0.000000000,0,0,0,0\n"
        + table([f"{t:.9f}", *levels(RUNS[0], t)] for t, _, _ in RUNS[0]))  # fmt: skip
    found["sigrok"] = Shape((
        "; CSV generated by libsigrok\n; Channels (4/8): D0, D1, D2, D3\n; Samplerate: 5 kHz\n"
        + "logic,logic,logic,logic\n"
        + "".join(",".join(map(str, levels(RUNS[0], t))) + "\n" for t in TIMES)
        + "FRAME-END\n").encode(),
        RUNS[:1], sampled=STEP, bare=True)  # fmt: skip
    found["sigrok, inputs with names"] = Shape(
        found["sigrok"].content.replace(b"D0, D1, D2, D3", b"top, upper, lower, bottom"),
        RUNS[:1], sampled=STEP, bare=True)  # fmt: skip
    head, initial, *changes = found["Saleae"].content.decode().splitlines(keepends=True)
    inverted = [re.sub(",([01])", lambda x: f",{1 - int(x[1])}", line) for line in changes]
    for name, rows, truth in (
        ("from its first change", changes, RUNS[0]),
        ("from its first change, pulled up", inverted, RUNS[0]),
        ("from within a beam", [initial.replace(",0", ",1", 1), *changes[1:]], RUNS[0][1:]),
        ("with a cell left empty", [initial.replace(",0", ",", 1), *changes], RUNS[0]),
    ):
        found[f"Saleae {name}"] = Shape((head + "".join(rows)).encode(), [truth])
    one = ("--channel", "0")
    on, off = (time for time, _, _ in by_gate(RUNS[0])[0])
    found["phyphox, start and stop"] = Shape(
        b'"Start (s)"\t"Stop (s)"\t"Difference (s)"\n'
        + f"{on:.9E}\t{off:.9E}\t{off - on:.9E}\n".encode(),
        [RUNS[0][:2]], options=one)  # fmt: skip
    found["Tektronix MDO, a channel"] = scope(
        "Model,MDO3024\nPoint Format,Y,\nSample Interval,2e-04,\nLabel,gate\nTIME,CH1\n",
        lambda k, t, v: f"{t - 0.1:.7e},{v[0]:.3f}\n", gates=[0], options=one)  # fmt: skip
    found["Hantek, volts alone"] = scope(
        "#CHANNEL:CH1\n#CLOCK=0.000200000S\n#SIZE=2000\n#UNITS:V\n\n",
        lambda k, t, v: f"{v[0]:.6f}\n", gates=[0], options=one, bare=True)  # fmt: skip
    found["sigrok, no heading"] = Shape(
        found["sigrok"].content.replace(b"logic,logic,logic,logic\n", b""),
        RUNS[:1], sampled=STEP, bare=True)  # fmt: skip
    found["VCD"] = text(vcd(RUNS[0]))
    zeros = "#0\n" + "".join(f"0{mark}\n" for mark in "!#$%")
    found["VCD from its first change"] = text(vcd(RUNS[0]).replace(zeros, ""))
    found["Levels without a heading"] = text("0.000000,0,0,0,0\n" + LEVELS)
    found["Time at each gate"] = Shape(
        (
            ",".join(f"Time at gate {g} (s)" for g in HEIGHTS)
            + "\n"
            + table([f"{t:.6f}" for t, _, d in edges if d] for edges in RUNS)
        ).encode(),
        [[e for e in edges if e[2]] for edges in RUNS],
    )
    tds = ["Record Length,4e+03,", "Sample Interval,2e-04,", "Trigger Point,0,", "Source,CH{},",
           "Vertical Units,V,", "Horizontal Units,s,"]  # fmt: skip
    for name, gates, options in (
        ("Tektronix TDS", [0], ("--channel", "0")),
        ("Tektronix TDS, two channels", [0, 1], ("--map", "CH1=0,CH2=1")),
    ):
        found[name] = scope("", lambda k, t, v: ",".join(
            f"{tds[k].format(n) if k < len(tds) else ',,'}{t:.7e},{x:.5f}"
            for n, x in enumerate(v, 1)) + ",\n", gates=gates, options=options)  # fmt: skip
    return found
