"""Damage costs what is damaged: any value of any row altered, through every command that reads."""

import random
import shutil

import pytest

from bench.mutants import VALUES, Mutants, make_session
from rig import door
from rig.analysis.session import analyze
from rig.errors import RigError
from rig.records import ClockSample, HostBreak, Job, Pulse
from rig.results.whole import calibration, protocol_of
from rig.session.store import Session
from tests.session.altering import alter
from tests.tables import cases, read_table

pytestmark = pytest.mark.usefixtures("analysed_once", "undrawn")
RUNS = 3
HZ = 16_000_000
PARTS = 200
OF_DROPS = {"drop", "edge", "bytes"}
COMMANDS = read_table(__file__, "commands")["damaged"]


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    path = make_session(tmp_path_factory.mktemp("sound"), RUNS)
    with Session.open(path) as session:  # in which each table has rows
        begun_ns, second = session.identities()[-1][0], 10**9
        for number in range(1, 9):
            at_ns, tick = begun_ns + number * second, number * HZ
            session.add_timing(ClockSample(at_ns, at_ns + 1000, tick))
            session.add_timing(Pulse(at_ns, at_ns + 1000, number, tick))
        session.add_timing(HostBreak(begun_ns + 20 * second, second, 0))
    return path


@pytest.fixture(scope="module")
def without(sound):
    """What the drops say that are not among the given ones, as if these were not there."""
    kept = {}
    with Session.open(sound, readonly=True) as session:
        drops, protocol, clock = [*session.drops()], protocol_of(session), calibration(session)

    def numbers(damaged):
        if damaged not in kept:
            left = [drop for drop in drops if Job(drop.run, drop.attempt).run not in damaged]
            runs = analyze(protocol, left, clock.scale).runs
            kept[damaged] = [one.json() for one in runs]
        return kept[damaged]

    return numbers


def read(call, path, folder, what):
    """Call each command; return the exit codes and what `analyze` says in JSON, if it does."""
    codes, found = {}, None
    for command, options in COMMANDS.items():
        given = [one if one.startswith("-") else folder / one for one in options]
        # Where a replay differs it says so in a code of its own.
        ends = {0, 1, 2, 3} if command == "replay" else {0, 2, 3}
        more = ["--json"] if command == "analyze" else []
        done = call(command, path, *given, *more, code=ends)
        codes[command] = done.code
        assert "bug" not in done.err, (what, done.err)
        if command == "analyze" and done.code != 2:
            found = done.json
    try:
        with door.open(path) as session:
            session.analyze()
            session.edges(1)
    except RigError:
        pass
    return codes, found


def check(call, without, path, folder, table, what):
    codes, found = read(call, path, folder, what)
    if found is None or table not in OF_DROPS:
        return
    damaged = frozenset(run["run"] for run in found["runs"] if run.get("damaged"))
    for run in found["runs"]:
        if run["run"] in damaged:
            assert run["verdict"] == "void", what
            assert run["reasons"][0].startswith("damaged: "), what
            assert len(run["reasons"]) == 1, what
    left = [run for run in found["runs"] if run["run"] not in damaged]
    for run in left:
        del run["calibration"]
    assert left == without(damaged), what
    for command in ("analyze", "export", "report"):
        assert codes[command] == (3 if damaged else 0), (what, command)
    assert codes["recover"] == 2 or not damaged, what


@pytest.mark.parametrize(
    "part", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in range(1, PARTS))]
)
def test_any_value_altered_costs_its_own_drop_and_no_other(part, call, sound, without, tmp_path):
    mutants = Mutants(sound, tmp_path)
    every = [
        (table, column, value, row)
        for table, column in mutants.columns
        for value in VALUES
        for row in (0, 2)
    ]
    random.Random(1).shuffle(every)
    path = tmp_path / "mutant"
    for table, column, value, row in every[part::PARTS]:
        what = mutants.alter(path, table, column, value, row=row)
        check(call, without, path, tmp_path, table, what)


@cases
def test_a_damaged_drop_is_called_damaged_and_the_others_are_analysed(
    sql, bytes_too, call, sound, without, tmp_path
):
    path = tmp_path / "altered"
    path.write_bytes(sound.read_bytes())
    alter(path, *["DELETE FROM bytes"] * bytes_too, sql)
    check(call, without, path, tmp_path, "edge", sql)
    found = call("analyze", "--json", path, code=3).json
    assert [run["run"] for run in found["runs"] if run.get("damaged")] == [2]
    assert "1 of 3 drops (run 2, attempt 1)" in call("analyze", path, code=3).out
    done = call("export", path, "--csv", tmp_path / "tables", code=3)
    assert "rig recover SESSION" in done.err
    page = tmp_path / "page.html"
    assert "1 of 3 drops (run 2, attempt 1)" in page.read_text("utf-8")


@pytest.mark.parametrize("which", range(4))
def test_altered_bytes_of_the_log_cost_no_drop(which, sound, tmp_path):
    """The edges have their certificate's CRC."""
    path = shutil.copy(sound, tmp_path / "altered")
    alter(path, f"UPDATE bytes SET data = zeroblob(length(data)) WHERE id % 4 = {which}")
    with Session.open(path, readonly=True) as session:
        assert [drop.damage for drop in session.drops()] == [""] * RUNS
