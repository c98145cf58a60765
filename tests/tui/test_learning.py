"""The session page says what ``rig analyze`` says; and the list of sessions."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from textual.widgets import OptionList

from rig.analysis.comparison import compare
from rig.reasons import plain_reason
from rig.records import Job
from rig.results.live import LiveAnalysis
from rig.results.whole import notes
from rig.session.schema import RunState
from rig.session.store import Session
from rig.tui.app import RigApp
from rig.tui.choosing import chosen
from rig.tui.context import Options
from rig.tui.picking import session_list
from rig.tui.plots import control_pictures, laid_over, run_picture
from rig.tui.why import speed_picture, why_words
from rig.wordings import NOTE
from tests.cli.lab import rig, short
from tests.tui.lab import KEYS, Operator, run


@pytest.fixture(scope="module")
def recorded(tmp_path_factory) -> Path:
    """Record four drops of two chains."""
    folder = tmp_path_factory.mktemp("learned")
    protocol, session = folder / "abba.yaml", folder / "abba.session"
    protocol.write_text(short("[40 deg]", 4), "utf-8")
    done = rig("run", protocol, "--port", "sim://?seed=5", "--session", session, "--yes")
    assert done.returncode == 0, done.stderr
    return session


def test_both_control_charts_are_there(recorded):
    found = LiveAnalysis(recorded).read()
    skew, gravity = control_pictures(found)
    assert "skew" in skew.y_label
    assert "g in free fall" in gravity.y_label
    for chart in (skew, gravity):
        points = [x for one in chart.series if one.kind == "bars" for x in one.x]
        assert sorted(points) == [1.0, 2.0, 3.0, 4.0]
    runs = tuple(replace(run, gravity=None) for run in found.analysis.runs)
    assert len(control_pictures(replace(found, analysis=replace(found.analysis, runs=runs)))) == 1


def test_why_the_chain_that_strikes_arrives_first(recorded):
    view = LiveAnalysis(recorded).read()
    job = view.jobs[0]
    measured, g = view.results[job].quantities, 9.81
    way, apart = 0.180 + 1.165, measured["separation_m"].value
    later_ms = 1e3 * (math.sqrt(2 * way / g) - math.sqrt(2 * (way - apart) / g))
    said = why_words(view, job)
    assert f"free fall {math.sqrt(2 * g * way):.3f}, model" in said
    assert f"the striking chain wins by {apart * 100:.1f} cm, or {later_ms:.0f} ms" in said
    size, normal = re.search(r"Δz differs from the model by (\S+) mm; ± (\S+) mm", said).groups()
    ((difference,),) = (
        one.differences
        for one in compare(view.protocol, [[view.results[job]]])
        if one.quantity == "separation_m"
    )
    last_digit = 10.0 ** -len(size.partition(".")[2])
    assert float(size) == pytest.approx(1e3 * abs(difference.value), abs=0.51 * last_digit)
    assert float(normal) > 1e3 * 2.0 * measured["separation_m"].u
    drawn = {one.label: one for one in speed_picture(view, job).series}
    assert drawn["model"].y[-1] - drawn["free fall"].y[-1] > 1.0
    jumps = np.diff(drawn["model"].y) - np.diff(drawn["free fall"].y)
    assert np.count_nonzero(jumps > 1e-9) == 25 - 1  # each rod that strikes pulls, but the top one


def test_drops_are_sifted_and_laid_over_each_other(recorded):
    view = LiveAnalysis(recorded).read()
    assert chosen(view, "") == chosen(view, "40° accepted") == view.jobs
    by_a, by_b = chosen(view, "a"), chosen(view, "B 40")
    assert {view.plan[job.run].impact for job in by_a} == {"A"}
    assert sorted((*by_a, *by_b)) == sorted(view.jobs)
    assert chosen(view, "A B") == chosen(view, "60") == ()
    apart = laid_over(view, view.jobs, view.jobs[2])
    assert [one.label for one in apart.series if one.label] == ["3 others", "model", "run 3"]
    beside = run_picture(view, by_a, by_a[0])
    measured = [view.results[job].quantities["separation_m"].value * 100 for job in by_a]
    assert [*beside.series[1].y, *beside.series[0].y] == measured


def test_drops_are_compared_and_files_are_written_from_inside(recorded, tmp_path):
    mine = tmp_path / "mine.session"
    mine.write_bytes(recorded.read_bytes())
    with Session.open(mine) as session:
        session.add_state(2, 1, RunState.ACCEPTED, 0, [plain_reason("a [draught]", NOTE)])
        session.commit()
    with Session.open(mine, readonly=True) as session:
        assert notes(session) == {Job(2, 1): "a [draught]"}

    async def work():
        app = RigApp(Options(session=mine, offline=True, still_s=0.0), KEYS)
        async with app.run_test(size=(120, 36)) as pilot:
            op = Operator(app, pilot)
            await op.sees("drop 1 of 4")
            await op.press("down")
            await op.sees("drop 2 of 4", "note: a [draught]")
            await op.press("k")
            await op.sees("3 others", "mean SD", "Δz corrected (cm)")
            await op.press("f", *"nothing", "enter")
            await op.sees("No drop matches nothing")
            await op.press("f", *["backspace"] * 7, *"40 B", "enter")
            await op.sees("drop 1 of 2 (40 B)")
            await op.press("g")
            await op.sees("Drops of this session")
            assert op.app.screen.query_one(OptionList).option_count == 2
            await op.press("backspace")
            await op.until(lambda: len(app.screen_stack) == 1)
            await op.press("e")
            await op.sees("Write files?", "mine.csv")
            await op.means()
            await op.sees("CSV files: ")

    run(work())
    assert (tmp_path / "mine.csv" / "edges.csv").is_file()


def test_a_session_is_looked_at_without_a_rig_and_another_one_is_picked(recorded):
    other = recorded.with_name("zero.session")
    Session.create(other, short(), "zero.yaml", simulated=True, origin="sim://").close()
    (recorded.parent / "broken.session").write_bytes(b"nothing")
    entries = {entry.path.name: entry for entry in session_list(recorded.parent)}
    assert list(entries) == ["broken.session", "zero.session", "abba.session"]  # newest first
    assert (entries["abba.session"].drops, entries["zero.session"].drops) == (4, 0)
    assert entries["broken.session"].trouble

    async def work():
        app = RigApp(Options(session=other, offline=True), KEYS)
        async with app.run_test(size=(120, 36)) as pilot:
            op = Operator(app, pilot)
            await op.sees("No drop recorded yet")
            await op.press("o")
            await op.sees("abba.session", "4 drops", "broken.session")
            await op.press("down", "enter")
            await op.sees("drop 1 of 4", "abba.session")
            await op.press("6", "g")
            await op.sees("Drops of this session", "run 4, attempt 1")
            await op.press("end", "enter")
            await op.sees("drop 4 of 4")
            await op.press("o")
            await op.sees("broken.session")
            await op.press("home", "enter")
            await op.sees("✗", "drop 4 of 4")

    run(work())


def test_the_session_page_says_how_many_taught_each_other(recorded):
    async def work():
        app = RigApp(Options(session=recorded, offline=True), KEYS)
        async with app.run_test(size=(120, 36)) as pilot:
            op = Operator(app, pilot)
            await op.press("5")
            await op.sees("joint fit of 4 runs", "release skew")
            await op.press("y")
            await op.sees("g in free fall", "check heights")

    run(work())
