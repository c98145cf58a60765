"""The same truth as a stranger writes it down: nobody's format, and all that goes wrong by hand."""

from __future__ import annotations

from tests.timers.shapes import HEIGHTS, RUNS, STEP, Shape, by_gate, levels, rows, table, text, vcd

WORDS = {True: "Blocked", False: "Clear"}


def comma(value: float, decimals: int = 6) -> str:
    return f"{value:.{decimals}f}".replace(".", ",")


def stamp(time: float, zero: str = "14:03:", digits: int = 6) -> str:
    return f"{zero}{10 + time:0{digits + 3}.{digits}f}"


def strangers() -> dict[str, Shape]:
    """Return files that may be read as the truth, or refused, but never read as anything else."""
    one, found = RUNS[0], {}

    def put(name: str, content: str, runs: int = 1, **more) -> None:
        found[name] = text(content, runs, **more)

    put(
        "Excel in German",
        "\ufeffLauf;Lichtschranke;Zeit [ms];Zustand\r\n"
        + "".join(
            f"{n};{c};{comma(t * 1e3, 3)};{'dunkel' if d else 'hell'}\r\n"
            for n, edges in enumerate(RUNS, 1)
            for t, c, d in edges
        ),
        3,
    )
    put(
        "Excel in French",
        "Essai;Barrière;Instant (ms);État\n"
        + "".join(
            f"{n};{c};{comma(t * 1e3, 3)};{'coupé' if d else 'libre'}\n"
            for n, edges in enumerate(RUNS, 1)
            for t, c, d in edges
        ),
        3,
    )
    put(
        "Spanish microseconds",
        "Ensayo\tBarrera\tTiempo (µs)\tEstado\n"
        + "".join(
            f"{n}\t{c}\t{t * 1e6:.0f}\t{'interrumpido' if d else 'libre'}\n"
            for n, edges in enumerate(RUNS, 1)
            for t, c, d in edges
        ),
        3,
    )
    put(
        "Milliseconds beside seconds",
        "gate,t (ms),t (s),state\n" + rows(lambda t, c, d: f"{c},{t * 1e3:.3f},{t:.6f},{int(d)}\n"),
    )
    put(
        "A unit in each cell",
        "gate,time,state\n" + rows(lambda t, c, d: f"{c},{t * 1e3:.3f} ms,{int(d)}\n"),
    )
    put(
        "Units that change",
        "gate,time,state\n"
        + "".join(
            f"{c},{t * 1e3:.3f} ms,{int(d)}\n" if n < 4 else f"{c},{t:.6f} s,{int(d)}\n"
            for n, (t, c, d) in enumerate(one)
        ),
    )
    put(
        "Dates of a spreadsheet",
        "Zeitpunkt;Kanal;Zustand\n" + rows(lambda t, c, d: f"24.11.2026 {stamp(t)};{c};{int(d)}\n"),
    )
    put(
        "ISO dates",
        "timestamp,channel,state\n"
        + rows(lambda t, c, d: f"2026-11-24T{stamp(t)}Z,{c},{int(d)}\n"),
    )
    put("Times of day", "time,channel,state\n" + rows(lambda t, c, d: f"{stamp(t)},{c},{int(d)}\n"))
    put(
        "Minutes and seconds",
        "time,channel,state\n" + rows(lambda t, c, d: f"0:{t:09.6f},{c},{int(d)}\n"),
    )
    put(
        "Epoch seconds",
        "timestamp,channel,state\n" + rows(lambda t, c, d: f"{1795000000 + t:.6f},{c},{int(d)}\n"),
    )
    put(
        "Runs by gaps, in ms",
        "Gate,Time (ms),State\n"
        + rows(lambda t, c, d: f"{c},{t * 1e3:.3f},{int(d)}\n", 3, gap=7.0),
        3,
    )
    put(
        "Runs by blank lines",
        "Gate,Time (s),State\n"
        + "\n".join("".join(f"{c},{t:.6f},{int(d)}\n" for t, c, d in edges) for edges in RUNS),
        3,
    )
    put(
        "Runs by a marker in words",
        "Gate,Time (s),State\n"
        + "".join(
            f"Versuch {n}:\n" + "".join(f"{c},{t:.6f},{int(d)}\n" for t, c, d in edges)
            for n, edges in enumerate(RUNS, 1)
        ),
        3,
    )
    put(
        "Runs by a word alone",
        "".join(
            "START\n" + "".join(f"{c},{t * 1e6:.0f},{int(d)}\n" for t, c, d in edges) + "STOP\n"
            for edges in RUNS
        ),
        3,
    )
    put(
        "Runs by a repeated heading",
        "".join(
            "gate,time (s),state\n" + "".join(f"{c},{t:.6f},{int(d)}\n" for t, c, d in edges)
            for edges in RUNS
        ),
        3,
    )
    put(
        "States the other way round",
        "gate,time (s),state\n" + rows(lambda t, c, d: f"{c},{t:.6f},{int(not d)}\n"),
    )
    put(
        "Signals the other way round",
        "pin,time (s),level\n" + rows(lambda t, c, d: f"{c},{t:.6f},{'LOW' if d else 'HIGH'}\n"),
    )
    put(
        "A channel for all gates",
        "channel,time (s),state\n" + rows(lambda t, c, d: f"1,{t:.6f},{int(d)}\n"),
    )
    put(
        "Samples of a channel for all gates",
        "time (s),state\n"
        + "".join(f"{n * 1e-3:.3f},{max(levels(one, n * 1e-3))}\n" for n in range(800)),
        sampled=1e-3,
    )
    found["Durations"] = Shape(
        (
            "gate,time in gate (s)\n"
            + table([c, f"{b[0] - a[0]:.6f}"] for c, (a, b) in by_gate(one).items())
        ).encode(),
        [],
    )
    found["Start and duration"] = Shape(
        (
            "gate,start (s),duration (s)\n"
            + table([c, f"{a[0]:.6f}", f"{b[0] - a[0]:.6f}"] for c, (a, b) in by_gate(one).items())
        ).encode(),
        [[edge for edge in one if edge[2]]],
    )
    put(
        "Gates from 1",
        "gate,time (s),state\n" + rows(lambda t, c, d: f"{c + 1},{t:.6f},{int(d)}\n"),
    )
    put(
        "Gates by letters",
        "gate,time (s),state\n" + rows(lambda t, c, d: f"{'ABCD'[c]},{t:.6f},{WORDS[d]}\n"),
    )
    put(
        "Gates by names",
        "gate,time (s),state\n"
        + rows(lambda t, c, d: f"{('top', 'upper', 'lower', 'bottom')[c]},{t:.6f},{WORDS[d]}\n"),
    )
    put(
        "A summary below",
        "gate,time (s),state\n"
        + rows(lambda t, c, d: f"{c},{t:.6f},{int(d)}\n")
        + "\nMean,0.56,\nCount,8,\n",
    )
    put(
        "Cells without a number",
        "time (s),gate 0,gate 1,gate 2,gate 3\n"
        + table([f"{t:.6f}", *(int(d) if g == c else "NaN" for g in HEIGHTS)] for t, c, d in one),
    )
    put(
        "Times of gates with NaN",
        "gate 0 (s),gate 1 (s),gate 2 (s),gate 3 (s)\n"
        + table([f"{t:.6f}" if g == c else "NaN" for g in HEIGHTS] for t, c, d in one),
    )
    put(
        "Carriage returns alone",
        ("gate,time (s),state\n" + rows(lambda t, c, d: f"{c},{t:.6f},{int(d)}\n")).replace(
            "\n", "\r"
        ),
    )
    put(
        "Spaces and tabs",
        "gate \t time (s) \t state\n" + rows(lambda t, c, d: f" {c} \t {t:.6f} \t {int(d)} \n"),
    )
    put(
        "A row for each gate",
        "gate,blocked (s),unblocked (s)\n"
        + table([c, f"{a[0]:.6f}", f"{b[0]:.6f}"] for c, (a, b) in by_gate(one).items()),
    )
    put(
        "A row for each run",
        "run,"
        + ",".join(f"gate {g} {w} (ms)" for g in HEIGHTS for w in ("on", "off"))
        + "\n"
        + table([n, *(f"{t * 1e3:.3f}" for t, _, _ in edges)] for n, edges in enumerate(RUNS, 1)),
        3,
    )
    put(
        "A column for each run",
        "Run 1,Run 2,Run 3\n"
        + table([f"{t:.6f}" for t, _, _ in three] for three in zip(*RUNS, strict=True)),
        3,
    )
    put(
        "Rows out of order",
        "gate,time (s),state\n"
        + "".join(f"{c},{t:.6f},{int(d)}\n" for t, c, d in [*one[4:], *one[:4]]),
    )
    put(
        "Newest first",
        "gate,time (s),state\n" + "".join(f"{c},{t:.6f},{int(d)}\n" for t, c, d in reversed(one)),
    )
    put(
        "A clock that overflows",
        "gate,time (us),state\n"
        + "".join(f"{c},{round(t * 1e6 + 2**32 - 5e5) % 2**32},{int(d)}\n" for t, c, d in one),
    )
    put(
        "Samples with an index",
        "n,D0,D1,D2,D3\n"
        + "".join(f"{n},{','.join(map(str, levels(one, n * STEP)))}\n" for n in range(4000)),
        sampled=STEP,
    )
    put(
        "Samples at a stated rate",
        "# sample rate: 5 kHz\nn,D0,D1,D2,D3\n"
        + "".join(f"{n},{','.join(map(str, levels(one, n * 2e-4)))}\n" for n in range(4000)),
        sampled=2e-4,
    )
    put(
        "A bit for each gate",
        "time (us),gates\n"
        + "".join(f"{t * 1e6:.0f},{''.join(map(str, levels(one, t)))}\n" for t, _, _ in one),
    )
    put(
        "Two tables",
        "gate,time (s),state\n"
        + "".join(f"{c},{t:.6f},{int(d)}\n" for t, c, d in one)
        + "\nheight,speed\n0.85,1.0\n0.6,2.4\n0.35,3.3\n",
    )
    put(
        "Twice the same",
        2 * ("gate,time (s),state\n" + rows(lambda t, c, d: f"{c},{t:.6f},{int(d)}\n")),
    )
    time, channel, dark = one[3]
    bounce = [(time + 2e-6, channel, not dark), (time + 4e-6, channel, dark)]
    found["A bouncing gate"] = Shape(
        (
            "gate,time (s),state\n"
            + "".join(f"{c},{t:.6f},{int(d)}\n" for t, c, d in [*one[:4], *bounce, *one[4:]])
        ).encode(),
        [[*one[:4], *bounce, *one[4:]]],
    )
    put(
        "Changes in nanoseconds",
        vcd(one).replace("1 us", "1 ns").replace("\n#", "\n#").replace("#0\n", "#0\n"),
    )
    put("Written by hand", "first drop\ngate 0: in 0,4110 out 0,4308\n")
    put(
        "Times rounded to ms",
        "gate,time (ms),state\n" + rows(lambda t, c, d: f"{c},{t * 1e3:.0f},{int(d)}\n"),
        sampled=5e-4,
    )
    put(
        "Thousands apart",
        "gate,time (us),state\n"
        + rows(
            lambda t, c, d: f"{c},{round(t * 1e6):,},{int(d)}\n".replace(
                f"{c},", f"{c};", 1
            ).replace(f",{int(d)}\n", f";{int(d)}\n")
        ).replace("gate,time (us),state", "gate;time (us);state"),
    )
    put(
        "Thousands by points",
        "Kanal;Zeit (µs);Zustand\n"
        + rows(lambda t, c, d: f"{c};{round(t * 1e6):,};{int(d)}\n".replace(",", ".")),
    )
    put(
        "Pipes",
        "| gate | time (s) | state |\n|---|---|---|\n"
        + rows(lambda t, c, d: f"| {c} | {t:.6f} | {int(d)} |\n"),
    )
    put(
        "XML",
        "<edges>\n"
        + rows(lambda t, c, d: f'<edge gate="{c}" time_s="{t:.6f}" state="{int(d)}"/>\n')
        + "</edges>\n",
    )
    put(
        "A JSON list",
        "["
        + ",\n".join(
            f'{{"gate": {c}, "time_s": {t:.6f}, "blocked": {str(d).lower()}}}' for t, c, d in one
        )
        + "]\n",
    )
    put(
        "JSON in a line",
        "["
        + ", ".join(
            f'{{"gate": {c}, "time_s": {t:.6f}, "blocked": {str(d).lower()}}}' for t, c, d in one
        )
        + "]\n",
    )
    return found


NOT_READ = {
    "A unit in each cell", "Units that change", "Runs by a word alone",
    "States the other way round", "A channel for all gates", "Samples of a channel for all gates",
    "Durations", "A summary below", "A row for each run", "A column for each run",
    "Rows out of order", "Newest first", "A clock that overflows", "Samples with an index",
    "Two tables", "Twice the same", "Changes in nanoseconds",
    "Written by hand", "Thousands apart", "Thousands by points", "Pipes", "XML", "JSON in a line",
}  # fmt: skip
"""Refused with what to do: the file leaves open, or contradicts, what is in it."""

REFUSED = {"empty": b"", "blank": b" \n\n", "binary": bytes(range(256)) * 40,
           "zip": b"PK\x03\x04" * 9,
           "picture": b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 9, "numbers": b"1\n2\n3\n",
           "zeros": b"\0" * 5000, "a heading": b"gate,time (s),state\n"}  # fmt: skip
