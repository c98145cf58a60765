"""An import accounts for every row, asks what no fall decides, and saves how a file is read."""

import shlex
import time
from contextlib import suppress

import pytest

from rig.errors import InputError
from rig.session.store import Session
from rig.timers import signals, timer_file
from tests.cli.lab import PROTOCOLS
from tests.tables import cases
from tests.timers.shapes import RUNS, shapes

BALL = PROTOCOLS / "falling-ball.yaml"


@pytest.fixture
def look(call, tmp_path):
    def run(content, *more, before=(), **ends):
        path = tmp_path / "file.txt"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return call("import", "--protocol", BALL, "--dry-run", *before, path, *more, **ends)

    return run


def rows(edges, form="{c},{t:.6f},{d}\n"):
    return "".join(form.format(t=t, c=c, d=int(d)) for t, c, d in edges)


HEAD = "gate,time (s),state\n"


FALL, MAPPED = RUNS[0], ("--map", "0=0,1=1,2=2,3=3")
UNUSED = rows(FALL) + "7,0.8,1\n7,0.81,0\n"


@pytest.mark.parametrize(
    ("content", "options", "code", "said"),
    [
        (rows(FALL), (), 0, "1 run, 8 rows: 8 edges"),
        (rows(FALL), (), 0, "8 of 8 edges where a fall puts them; g 9.8"),
        (rows((1.1 * t, c, d) for t, c, d in FALL), (), 0, "free fall gives g = 8."),
        (UNUSED, MAPPED, 2, "2 of 10 rows unused: lines 10, 11"),
        (UNUSED, (*MAPPED, "--allow-unused"), 0, "8 edges; 2 rows unused: lines 10, 11"),
        (rows(row for row in FALL if row[1] != 2), (), 0, "nothing of the gates at channels 2"),
        (rows((t, 1, d) for t, _, d in FALL), (), 2, ""),  # more than the object makes
        (rows((t, 1, d) for t, _, d in FALL), ("--as-read",), 0, ""),
        (5 * ("Run\n" + rows(FALL)) + "Run\n0,0.4,1\n0,0.9,0\n", (), 2,
         "file.txt:48:1: run 6: at most 12 % of its edges"),
    ],
)  # fmt: skip
def test_what_is_said_of_a_fall(look, content, options, code, said):
    done = look(HEAD + content, *options, code=code)
    assert said in done.out + done.err
    doubted = "the protocol says 9.8" in done.err
    assert doubted == said.startswith("free fall gives g = 8")


def test_samples_are_as_far_apart_as_most_of_them_at_any_date(look):
    content, levels = "time (s),gate 0,gate 1,gate 2,gate 3\n", dict.fromkeys(range(4), 0)
    for at, run in ((1764504000, RUNS[0]), (1764504005, RUNS[1])):
        for n in range(1600):
            levels |= {gate: int(dark) for when, gate, dark in run if when <= n * 5e-4}
            content += f"{at + n * 5e-4:.4f},{','.join(map(str, levels.values()))}\n"
    done = look(content)
    assert "2 of 2 runs compared: 16 of 16 edges" in done.out + done.err
    assert "sampled every 500 µs" in done.out + done.err


def test_two_wires_at_one_stamp_of_a_dump_are_refused(look):
    first, second = (f"#{round(time * 1e6)}\n" for time, _, _ in FALL[1:3])
    content = shapes()["VCD"].content.decode()
    done = look(content.replace(second, ""), code=2)
    assert first in content
    assert "inputs change at the same time, line 1" in done.err


@cases
def test_what_is_said_of_a_file(look, content, options, code, said):
    done = look(content, *options, code=code)
    assert said in done.out + done.err


@pytest.mark.parametrize(
    "content",
    [
        shapes()["Gates below each other"].content,
        shapes()["Milliseconds without a unit"].content,
        HEAD + rows(FALL[::-1]),
        "Run,gate 0 (s),gate 1 (s)\n1,0.40031,0.553153\n2,0.370305,0.523153\n",
    ],
)
def test_what_the_dry_run_prints_is_accepted(look, tmp_path, content):
    saved = tmp_path / "map.txt"
    first = look(content, "--map-file", saved)
    (printed,) = [line for line in first.out.splitlines() if line.startswith("--map ")]
    runs = [line for line in first.out.splitlines() if line.startswith("run ")]
    for again in (
        look(content, "--map", printed.split("'")[1]),
        look(content, "--map-file", saved),
    ):
        assert [line for line in again.out.splitlines() if line.startswith("run ")] == runs


def test_known_formats_are_listed(call):
    assert "Siglent SDS oscilloscope: " in call("import", "--list-formats").out


@pytest.mark.parametrize(
    "content",
    [
        "0.323\n0 1.5\n1 1.6\n0 1.7\n",
        "$timescale 1 us $end\n$enddefinitions $end\n#" + "9" * 5000 + "\n",
        "1" * 20_000 + "\n",
        "gate 1 blocked at " + "1" * 20_000 + "\n" + "gate 1 blocked at 12 us\n",
        "time (s),state\n" + "1" * 20_000 + ",1\n0.2,0\n",
        "a=" * 10_000 + "\n",
        ",".join("1" * 20_000) + "\n",
        "[" * 19_000 + "\n",
        '{"a": ' * 3000 + "\n",
        "[\n" + "0.1,\n" * 20_000,
    ],
)
def test_a_hostile_file_is_read_or_refused_at_once(tmp_path, content):
    path = tmp_path / "file"
    path.write_text(content, "utf-8")
    start = time.process_time()
    with suppress(InputError):
        signals.read_file(timer_file.TimerFile(path))
    assert time.process_time() - start < 1.0


TIMES = "Time (s),D7 (V),D9 (V)\n" + "".join(
    f"{n * 1e-3:.3f},{5 * (100 <= n < 140)},{5 * (300 <= n < 320)}\n" for n in range(600)
)


@cases
def test_pairs_are_understood_as_they_are_typed(look, typed, first):
    words = shlex.split(typed)
    done = look(TIMES, *words) if first else look(TIMES, before=words)
    assert "input D7 (V) is the gate at channel 0\n" in done.out
    assert "input D9 (V) is the gate at channel 3\n" in done.out
    assert "run 1: 4 edges in 0.22 s; by channel 0: 2, 3: 2" in done.out


def test_other_arguments_are_no_pairs(look, tmp_path):
    done = look(TIMES, "--map", "D7 (V)=0", f"--session={tmp_path}/a=b.session", "--dark", "high")
    assert "inputs that are no gate: D9 (V)" in done.err


@cases
def test_a_pair_that_is_none_is_located(look, typed, message):
    done = look(TIMES, *shlex.split(typed), code=2)
    assert done.err.startswith(message), done.err


def test_what_an_import_assumes_is_in_the_session_with_codes(call, tmp_path):
    events, path = tmp_path / "scope.csv", tmp_path / "s.session"
    events.write_text(TIMES, "utf-8")
    done = call("import", events, "--protocol", BALL, "--session", path, "--map", "D7 (V)=0")
    with Session.open(path, readonly=True) as session:
        ((_, timer),) = session.identities()
    reasons = {reason["code"]: reason["values"] for reason in timer["reason_codes"]}
    assert reasons["crossings"] == {"crossings": 2, "input": "D9 (V)", "level": 2.5}
    assert reasons["inputs_unused"] == {"inputs": "D9 (V)"}
    assert reasons["blocked_level"] == {"level": "high", "other": "low"}
    assert reasons["samples"]["period_us"] == pytest.approx(1000)
    assert len(timer["reasons"]) == len(timer["reason_codes"])
    for sentence in timer["reasons"]:
        assert f"{sentence}\n" in done.err
    assert (
        "assumed: a high signal is a blocked beam, because beams are clear at the beginning; "
        "--dark low reverses this\n"
    ) in done.err
