"""Several sessions as one: what cancels, what is refused, and what each command says of them."""

import json
import re
import shutil

import pytest

import rig as door
from rig.errors import InputError, SessionError
from rig.protocol import reader
from rig.results.together import SessionPart, results_together, same_owners
from rig.session.store import Session
from tests.analysis.kept_results import FOLDER
from tests.cli.lab import PROTOCOLS, record
from tests.refusals import refused
from tests.session.altering import alter


def record_few(folder, name, scene="picket-fence", seed=1, series=0, change=("", ""), repeats=4):
    """Record a session of few simulated drops."""
    text = (PROTOCOLS / f"{scene}.yaml").read_text("utf-8")
    text = re.sub(r"repeats: \d+", f"repeats: {repeats}", text).replace(*change)
    return record(folder, text, f"sim://?stated=1&missed=0&seed={seed}&series={series}", name)


@pytest.fixture
def two():
    """Two sessions of a fence, on two rigs."""
    return FOLDER / "rig-1.session", FOLDER / "rig-2.session"


def together(*paths, **options):
    files = [Session.open(path, readonly=True) for path in paths]
    try:
        return results_together(files, **options)
    finally:
        for file in files:
            file.close()


def test_runs_of_both_count_in_one_mean(two, call):
    said = call("analyze", *two, "--json").json
    (line,) = said["summary"]
    values = [run["gravity_m_s2"]["value"] for run in said["runs"]]
    assert line["gravity_m_s2"]["value"] == pytest.approx(sum(values) / 8)
    with door.open(two[0]) as first, door.open(two[1]) as other:
        found = (first + other).analyze()
    assert json.loads(json.dumps(found.json())) == said


def test_nothing_that_is_kept_is_used_where_that_is_asked_for(two, call, monkeypatch):
    monkeypatch.setattr("rig.cache.store.CacheFolder.get", None)
    call("compare", *two, "--fresh")


def test_what_one_rig_shares_is_one_unknown_and_of_two_rigs_there_are_two(two):
    one, each = (
        together(*two, same_rig=same).parts[0].analysis.joint.shared.blocks
        for same in (True, False)
    )
    assert {"beams", "datum", "drop", "clock"} <= set(one)
    assert {f"{name} (rig-{number}.session)" for name in one for number in (1, 2)} == set(each)


def test_errors_of_one_rig_cancel_in_the_difference_of_its_sessions(tmp_path):
    first, other = (record_few(tmp_path, f"s{n}", series=n) for n in (1, 2))
    (cancelled,) = together(first, other, same_rig=True).differences()
    found = together(first, other, same_rig=False)
    (whole,) = found.differences()
    assert cancelled.value.budget["common"] < 0.1 * whole.value.budget["common"]
    means = [part.analysis.summary[0].means["gravity_m_s2"] for part in found.parts]
    assert whole.value.value == pytest.approx(means[1].value - means[0].value)
    commons = [mean.budget["common"] for mean in means]
    assert whole.value.budget["common"] == pytest.approx(sum(u**2 for u in commons) ** 0.5, rel=0.1)


def test_of_one_rig_only_what_is_stated_alike_is_shared():
    text = (PROTOCOLS / "inclined-uniform.yaml").read_text("utf-8")
    moved = re.sub(r"height: 22 mm", "height: 23 mm", text, count=1)
    assert moved != text
    stated = reader.parse(text)
    parts = [SessionPart(*part, None, None) for part in (("a", stated), ("b", reader.parse(moved)))]
    owners = same_owners(parts, same_rig=None)
    assert owners["beams"] == [["a"], ["b"]]
    assert owners["posts"] == owners["chain A"] == owners["start"] == [["a", "b"]]
    titled = reader.parse(text.replace("title: ", "title: Other "))
    parts[1] = SessionPart("b", titled, None, None)
    assert same_owners(parts, same_rig=None)["posts"] == [["a"], ["b"]]
    assert same_owners(parts, same_rig=True)["posts"] == [["a", "b"]]
    parts[1] = SessionPart("b", stated, None, None, board="another")
    assert same_owners(parts, same_rig=None)["posts"] == [["a"], ["b"]]


def refused_by(code, kind, *paths, work=together):
    (reason,) = refused(kind, "", work, *paths).reasons
    assert reason.code == code


def test_another_scene_is_refused_and_what_has_no_incline_in_common(two, tmp_path):
    changes = (("", ""), ("incline: 40 deg", "incline: 50 deg"))
    first, other = (
        record_few(tmp_path, f"s{n}", "single-chain", series=n, change=change, repeats=1)
        for n, change in enumerate(changes, 1)
    )
    refused_by("sessions_unlike", InputError, first, two[0])
    found = together(first, other)
    refused_by("nothing_to_compare", InputError, work=found.differences)
    assert [line.condition.incline_deg for line in found.summary] == [40.0, 50.0]


def test_a_session_and_its_copy_are_one(two, tmp_path):
    copy = shutil.copy(two[0], tmp_path / "copy.session")
    refused_by("session_repeated", InputError, two[0], two[1], two[0])
    refused_by("session_repeated", InputError, two[0], copy)


def test_a_blind_session_is_refused(two, call):
    blind = FOLDER / "blind.session"
    refused_by("session_blind", SessionError, two[1], blind)
    for command in ("compare", "analyze"):
        assert call(command, two[1], blind, "--json", code=2).out == ""


def test_an_unfinished_session_is_refused_unless_it_is_asked_for(two, tmp_path):
    more = tmp_path / "more.session"
    with Session.open(two[1], readonly=True) as whole:
        first = next(whole.drops())
        with Session.create(
            more, whole.protocol_text, "more", simulated=True, origin="test"
        ) as part:
            part.add_drop(first)
    refused_by("session_unfinished", InputError, two[0], more)
    assert together(two[0], more, unfinished=True).differences()


def test_a_damaged_session_is_refused(two, tmp_path):
    copy = shutil.copy(two[0], tmp_path / "copy.session")
    alter(copy, 'UPDATE "drop" SET crc32 = crc32 + 1 WHERE id = 2')
    refused_by("records_damaged", InputError, two[1], copy)
