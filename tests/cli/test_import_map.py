"""``rig import --map`` takes what people type: blanks, commas, or both."""

import shlex

import pytest

from rig.session.store import Session
from tests.cli.lab import PROTOCOLS
from tests.tables import cases

TIMES = "Time (s),D7 (V),D9 (V)\n" + "".join(
    f"{n * 1e-3:.3f},{5 * (100 <= n < 140)},{5 * (300 <= n < 320)}\n" for n in range(600)
)


@pytest.fixture
def look(call, tmp_path):
    (tmp_path / "scope.csv").write_text(TIMES, "utf-8")
    known = ("--protocol", PROTOCOLS / "falling-ball.yaml", "--dry-run")

    def run(typed, *, first=True, **ends):
        words, events = shlex.split(typed), tmp_path / "scope.csv"
        where = (events, *known, *words) if first else (*known, *words, events)
        return call("import", *where, **ends)

    return run


@cases
def test_pairs_are_understood_as_they_are_typed(look, typed, first):
    done = look(typed, first=first)
    assert "input D7 (V) is the gate at channel 0\n" in done.out
    assert "input D9 (V) is the gate at channel 3\n" in done.out
    assert "run 1: 4 edges in 0.22 s; by channel 0: 2, 3: 2" in done.out


def test_other_arguments_are_no_pairs(look, tmp_path):
    done = look(f"--map 'D7 (V)=0' --session={tmp_path}/a=b.session --dark high")
    assert "inputs that are no gate: D9 (V)" in done.err


@cases
def test_a_pair_that_is_none_is_located(look, typed, message):
    done = look(typed, code=2)
    assert done.err.startswith(message), done.err


def test_what_an_import_assumes_is_in_the_session_with_codes(call, tmp_path):
    events, path = tmp_path / "scope.csv", tmp_path / "s.session"
    events.write_text(TIMES, "utf-8")
    ball = PROTOCOLS / "falling-ball.yaml"
    done = call("import", events, "--protocol", ball, "--session", path, "--map", "D7 (V)=0")
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
