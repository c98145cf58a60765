"""The same truth as a stranger writes it down: nobody's format, and all that goes wrong by hand."""

from __future__ import annotations

from tests.timers.shapes import (
    HEIGHTS,
    LEVELS,
    RUNS,
    STEP,
    TIMES,
    Shape,
    by_gate,
    csv,
    from_rows,
    from_scopes,
    levels,
    scope,
    table,
    vcd,
    write,
)

GTS = "gate,time (s),state\n"


def strangers() -> dict[str, Shape]:
    """Return files that may be read as the truth, or refused, but never read as anything else."""
    one, files = RUNS[0], {}

    def put(name, content, truth=RUNS[:1], **more) -> None:
        files[name] = Shape(content.encode(), truth, **more)

    files |= from_rows("strangers") | from_scopes("strange scopes")
    each = [write("{c},{s},{d}\n", runs=[edges]) for edges in RUNS]
    numbered = table([n, *(f"{t:.6f}" for t, _, _ in edges)] for n, edges in enumerate(RUNS, 1))
    passings = table([c, f"{a[0]:.6f}", f"{b[0]:.6f}"] for c, (a, b) in by_gate(one).items())
    for name, content in (
        ("Runs by blank lines", GTS + "\n".join(each)),
        ("Runs by a title", "\n".join(
            f"Run {n} of 3\n{GTS}{rows}" for n, rows in enumerate(each, 1))),
        ("Runs by a word alone", "".join(f"START\n{rows}STOP\n" for rows in each)),
        ("Runs by gaps", "time_s,gate,blocked\n" + "".join(
            f"{t + 12 * n:.6f},{c},{int(d)}\n" for n, edges in enumerate(RUNS)
            for t, c, d in edges)),
        ("A row for each run", "run,"
         + ",".join(f"gate {g} {w} (ms)" for g in HEIGHTS for w in ("on", "off")) + "\n"
         + table([n, *(f"{t * 1e3:.3f}" for t, _, _ in edges)] for n, edges in enumerate(RUNS, 1))),
        ("A column for each run", "Run 1,Run 2,Run 3\n"
         + table([f"{t:.6f}" for t, _, _ in three] for three in zip(*RUNS, strict=True))),
        ("On and off of each gate", ",".join(
            f"Gate {g} {w}" for g in HEIGHTS for w in ("on", "off")) + "\n"
         + table([f"{t:.6f}" for t, _, _ in edges] for edges in RUNS)),
        ("Pairs in German", "Versuch;" + ";".join(f"L{g} {w} (s)" for g in HEIGHTS
         for w in ("an", "aus")) + "\n"
         + numbered.replace(",", ";")),
        ("Gates over pairs of columns", "," + ",,".join(f"Gate {g}" for g in HEIGHTS) + ",\n"
         + "Run," + ",".join(["in (s),out (s)"] * len(HEIGHTS)) + "\n"
         + numbered),
        ("A sum beside pairs of columns", ",,".join(f"Gate {g}" for g in HEIGHTS) + ",,\n"
         + ",".join(["in (s),out (s)"] * len(HEIGHTS)) + ",all (s)\n"
         + table([*(f"{t:.6f}" for t, _, _ in edges), "0.3"] for edges in RUNS)),
        ("A name for two columns", "run," + ",,".join(f"Gate {g} (s)" for g in HEIGHTS) + ",\n"
         + numbered),
        ("Times of a row, numbered", "drop," + ",".join(f"t{k}" for k in range(1, 9)) + "\n"
         + numbered),
        ("A list for each run", "[[" + "],\n [".join(
            ", ".join(f"{t:.6f}" for t, _, _ in edges) for edges in RUNS) + "]]\n"),
    ):  # fmt: skip
        put(name, content, RUNS)
    for name, content in (
        ("Units that change", "gate,time,state\n" + write("{c},{ms} ms,{d}\n", runs=[one[:4]])
         + write("{c},{s} s,{d}\n", runs=[one[4:]])),
        ("Cells without a number", "time (s),gate 0,gate 1,gate 2,gate 3\n" + table(
            [f"{t:.6f}", *(int(d) if g == c else "NaN" for g in HEIGHTS)] for t, c, d in one)),
        ("Times of gates with NaN", "gate 0 (s),gate 1 (s),gate 2 (s),gate 3 (s)\n" + table(
            [f"{t:.6f}" if g == c else "NaN" for g in HEIGHTS] for t, c, d in one)),
        ("A row for each gate", "gate,blocked (s),unblocked (s)\n" + passings),
        ("Rows out of order", GTS + write("{c},{s},{d}\n", runs=[[*one[4:], *one[:4]]])),
        ("Newest first", GTS + write("{c},{s},{d}\n", runs=[one[::-1]])),
        ("A clock that overflows", "gate,time (us),state\n" + "".join(
            f"{c},{round(t * 1e6 + 2**32 - 5e5) % 2**32},{int(d)}\n" for t, c, d in one)),
        ("A bit for each gate", "time (us),gates\n" + "".join(
            f"{t * 1e6:.0f},{''.join(map(str, levels(one, t)))}\n" for t, _, _ in one)),
        ("Twice the same", 2 * (GTS + each[0])),
        ("Changes in nanoseconds", vcd(one).replace("1 us", "1 ns")),
        ("Thousands by points", "Kanal;Zeit (µs);Zustand\n" + "".join(
            f"{c};{round(t * 1e6):,};{int(d)}\n".replace(",", ".") for t, c, d in one)),
        ("JSON in a line", "[" + ", ".join(
            f'{{"gate": {c}, "time_s": {t:.6f}, "blocked": {int(d)}}}' for t, c, d in one) + "]"),
        ("JSON, a list of lines", "[\n" + ",\n".join(
            f'{{"gate": {c}, "ts_ns": {t * 1e9:.0f}, "blocked": {str(d).lower()}}}'
            for t, c, d in one) + "\n]\n"),
        ("A month that ends", "gate,time,state\n" + "".join(
            f"{c},2026-{'11-30 23:59' if t < 0.5 else '12-01 00:00'}:{(t - 0.5) % 60:.6f}"
            f",{int(d)}\n" for t, c, d in one)),
        ("A row twice", GTS + each[0] + each[0].splitlines()[-1]),
        ("The last row cut", GTS + each[0][:-3]),
    ):  # fmt: skip
        put(name, content)
    late = "# of a timer\n" * 400 + GTS.replace("(s)", "(µs)") + write("{c},{us},{d}\n")
    files["Letters of Windows far below"] = Shape(late.encode("cp1252"), RUNS[:1])
    put("Durations", "gate,time in gate (s)\n" + table(
        [c, f"{b[0] - a[0]:.6f}"] for c, (a, b) in by_gate(one).items()), [])  # fmt: skip
    put("Start and duration", "gate,start (s),duration (s)\n" + table(
        [c, f"{a[0]:.6f}", f"{b[0] - a[0]:.6f}"] for c, (a, b) in by_gate(one).items()),
        [[edge for edge in one if edge[2]]])  # fmt: skip
    put(
        "Minutes and seconds",
        "min,sec,gate,state\n"
        + table([int((t + 59.5) // 60), f"{(t + 59.5) % 60:.6f}", c, int(d)] for t, c, d in one),
    )
    put("A state without a name", "Time (s),State 0,State 1,,State 3\n0.000000,0,0,0,0\n" + LEVELS)
    time, channel, dark = one[3]
    bounce = [(time + 2e-6, channel, not dark), (time + 4e-6, channel, dark)]
    bouncing = [[*one[:4], *bounce, *one[4:]]]
    put("A bouncing gate", GTS + write("{c},{s},{d}\n", runs=bouncing), bouncing)
    ms = GTS.replace("(s)", "(ms)") + "".join(f"{c},{t * 1e3:.0f},{int(d)}\n" for t, c, d in one)
    put("Times rounded to ms", ms, sampled=5e-4)
    put("Counts below decimals", "Run 1\ngate,time,state\n" + write("{c},{ms},{d}\n")
        + "Run 2\nstate,gate,time\n" + write("{d},{c},{coarse}\n", runs=RUNS[1:2]),
        RUNS[:2], sampled=5e-4)  # fmt: skip
    bits = "".join(f"{n},{','.join(map(str, levels(one, t)))}\n" for n, t in enumerate(TIMES))
    put("Samples with an index", "n,D0,D1,D2,D3\n" + bits, sampled=STEP)
    put("Samples at a stated rate", "# Fs = 5 kHz\nn,D0,D1,D2,D3\n" + bits, sampled=STEP)
    put("Samples of a channel for all gates", "time (s),state\n" + "".join(
        f"{n * 1e-3:.3f},{max(levels(one, n * 1e-3))}\n" for n in range(800)),
        sampled=1e-3)  # fmt: skip
    files["Decimal commas"] = scope(
        "Zeit [s]\tU0 [V]\tU1 [V]\tU2 [V]\tU3 [V]\n",
        lambda k, t, v: table([[f"{x:.5f}" for x in (t, *v)]], "\t").replace(".", ","),
    )
    files["Axes by numbers"] = scope(
        "x-axis,1,2,3,4\nsecond,Volt,Volt,Volt,Volt\n", csv, options=("map", "1=0,2=1,3=2,4=3")
    )
    files["Exponents of Fortran"] = scope(
        "# t(s) A0 A1 A2 A3\n",
        lambda k, t, v: table([[f"{x:.5E}".replace("E", "D") for x in (t, *v)]], " "),
    )
    put(
        "DSView",
        "; Sample rate: 1 MHz\nTime(s), 0, 1, 2, 3\n"
        + "".join(
            f"{t:.6f}, {', '.join(map(str, levels(one, t)))}\n" for t, _, _ in [(0, 0, 0), *one]
        ),
    )
    late = [edge for edge in one if edge[1]]
    put(
        "Inputs without names, of which the first gate is not among them",
        table([f"{t:.6f}", *levels(one, t)[1:]] for t in (0, *(t for t, _, _ in late))),
        [late],
    )
    put("More names than columns", "gate,blocked (s),clear (s),foo\n" + passings)
    put(
        "A row for each gate that is passed",
        "n,start (s),end (s)\n"
        + table([c + 1, f"{a[0]:.6f}", f"{b[0]:.6f}"] for c, (a, b) in by_gate(one).items()),
    )
    return files


NOT_READ = {
    "Runs by a word alone", "Written by hand",
    "A channel for all gates", "Samples of a channel for all gates",
    "Durations", "A summary below", "A name for two columns",
    "Minutes and seconds", "Seconds that are called minutes",
    "Samples with an index",
    "Two tables", "Twice the same", "Changes in nanoseconds",
    "Microseconds as if they were seconds",
    "The last row cut", "A row twice", "An unknown column in a unit of time",
}  # fmt: skip
"""Refused with what to do: the file leaves open, or contradicts, what is in it."""

REFUSED = {"durations": b"1.35\n2.05\n1.68\n1.87\n1.76\n1.78\n",
           "a time before that above it": b"gate,time,state\n0,0.2,1\n0,0.1,0\n",
           "a fault in the first row": b"gate,time (s),state\n0,0.4O0305,1\n0,0.420600,0\n"
           b"1,0.553153,1\n1,0.561398,0\n2,0.641801,1\n2,0.647889,0\n",
           "counts of years": b"gate,time,state\n0,1,1\n0,9999999999,0\n1,999999999900,1\n",
           "empty": b"", "blank": b" \n\n", "binary": bytes(range(256)) * 40,
           "zip": b"PK\x03\x04PK\x03\x04",
           "picture": b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 9, "numbers": b"1\n2\n3\n",
           "zeros": b"\0" * 5000, "a heading": b"gate,time (s),state\n",
           "a broken setting": b"gate,start (s),duration (s)\n0,0.40030590.020295\n1,0.553153,"
           b"0.008245\n2,0.641801,0.006088a3,0.711323,0.005048\n",
           "broken NaN": b"gate 0 (s),gate 1 (s),gate 2 (s),gate 5 (s.\n0.400305,NaN,NaN,NaN\n"
           b"0.420600,NaN,NaN,NaN\nNaN,0.553153,NaN,NaN\nNaN,0.561398,NaN,NaN\n"
           b"NaN,NaN,0.641801,NaN\nNaN,NaN,0.647889,NaN\nNaN,;aN,NaN,0.711323\nNaN,N\n"
           b"N,NaN,0.716371\n"}  # fmt: skip
