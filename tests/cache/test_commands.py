"""Commands on an unchanged session: the same bytes again, and nothing is computed for them."""

import hashlib
import os
import shutil
from pathlib import Path

import pytest

import rig
from rig.analysis.drop import DropCase
from rig.cache.store import CacheFolder
from rig.cli import main
from rig.session.schema import RunState
from rig.session.store import Session
from tests.cli import lab
from tests.cli.lab import PROTOCOLS, record, short
from tests.report.undrawn import undrawn  # noqa: F401 - a fixture
from tests.session.altering import unguarded
from tests.tables import read_table

SCENES = read_table(__file__, "scenes")
COMMANDS = [words.split() for words in read_table(lab.__file__, "commands")["kept"]]


def record_scene(folder, scene):
    name, dials = SCENES[scene]
    text = (PROTOCOLS / name).read_text("utf-8") if name else short("[40 deg]", 4)
    if scene == "fence":  # enough for a joint fit
        text = text.replace("repeats: 10", "repeats: 4")
    return record(folder, text, f"sim://?seed=3&{dials}", codes=(0, 3))


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(name, marks=() if name == "fence" else pytest.mark.slow) for name in SCENES
    ],
)
def session(request, tmp_path_factory):
    if request.param == "fence":
        return request.getfixturevalue("recorded")
    return record_scene(tmp_path_factory.mktemp(request.param), request.param)


def fingerprint(folder: Path) -> dict[str, str]:
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {
        str(at.relative_to(folder)): hashlib.sha256(at.read_bytes()).hexdigest() for at in files
    }


def ended(command, session, folder, capsys, *more):
    """Exit code, both streams and all files of a command."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    capsys.readouterr()
    places = {"SESSION": str(session)}
    words = [places.get(word, word.replace("OUT", str(folder))) for word in command]
    return main([*words, *more]), *capsys.readouterr(), fingerprint(folder)


def refuse(*_, **__):
    raise AssertionError("computed again")


@pytest.mark.usefixtures("undrawn")
def test_what_is_kept_is_said_again_to_the_last_byte(session, tmp_path, capsys, monkeypatch):
    """Cold, kept, forced, and kept of a copy, and the session stays as it is."""
    monkeypatch.setattr("rig.report.canvas.KINDS", ("svg",))
    before = fingerprint(session.parent)
    out = tmp_path / "out"
    cold = [ended(command, session, out, capsys) for command in COMMANDS]
    with monkeypatch.context() as patch:
        for work in ("rig.analysis.drop.DropCase.summary", "rig.analysis.session.joint_fit",
                     "rig.results.estimated.estimate", "rig.commands.report.session_page",
                     "rig.analysis.drop.DropCase.read"):  # fmt: skip
            patch.setattr(work, refuse)
        at = [n for n, end in enumerate(cold) if end[0] in {0, 3}]
        assert len(at) > 5
        for n in at:
            assert ended(COMMANDS[n], session, out, capsys) == cold[n]
    for command, end in zip(COMMANDS[:2], cold, strict=False):
        assert ended(command, session, out, capsys, "--fresh") == end
    assert fingerprint(session.parent) == before


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Record a fence; what is kept of it lies beside."""
    folder = tmp_path_factory.mktemp("recorded")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder / "caches"))
        return record_scene(folder, "fence")


@pytest.fixture
def fence(recorded, tmp_path):
    shutil.copytree(recorded.with_name("caches"), os.environ["XDG_CACHE_HOME"])
    return Path(shutil.copy(recorded, tmp_path / "fence.session"))


@pytest.fixture
def counted(monkeypatch):
    """Whose drops were analysed."""
    drops = []

    def summary(case, *arguments, **options):
        drops.append(case.run.number)
        return work(case, *arguments, **options)

    work = DropCase.summary
    monkeypatch.setattr(DropCase, "summary", summary)
    return drops


def analysed(path):
    with rig.open(path) as session:
        return session.analyze()


def test_of_a_record_that_was_added_to_only_what_is_new_is_analysed(fence, counted):
    with rig.open(fence) as session:
        before = session.analyze().json()
        assert session.analyze().json() == before
    assert len(counted) == 0  # rig run kept it
    with Session.open(fence) as session:
        session.add_state(3, 1, RunState.REJECTED, 0)
    again = analysed(fence)
    assert len(counted) == 0
    assert again.summary[0].n == before["summary"][0]["n"] - 1
    assert again.runs[2].verdict == "rejected"


@pytest.mark.parametrize("table", ["edge", "ping"])
def test_a_record_of_which_a_number_was_altered_is_analysed_again(fence, counted, table):
    """The file has the same length, name and time."""
    about = fence.stat()
    with unguarded(fence) as connection:
        connection.execute(f"UPDATE {table} SET tick = tick + 1")
    os.utime(fence, ns=(about.st_atime_ns, about.st_mtime_ns))
    analysed(fence)
    assert len(counted) == 4


def test_another_program_computes_itself(fence, counted, monkeypatch):
    monkeypatch.setattr("rig.cache.entry._program", lambda: "another")
    analysed(fence)
    assert len(counted) == 4


@pytest.mark.parametrize(
    "text", ["", "[]", '["list",1]', "no JSON", '["rig.records:Job",1,1]', "[" * 100_000]
)
def test_what_is_kept_and_cannot_be_read_is_computed_again(fence, counted, monkeypatch, text):
    with monkeypatch.context() as patch:
        patch.setattr(CacheFolder, "get", lambda *_: text)
        analysed(fence)
    assert len(counted) == 4


def test_doctor_tells_the_size_and_forgets(fence, call):
    told = call("doctor", code={0, 4}).out
    line = next(one for one in told.splitlines() if "kept results" in one)
    assert str(CacheFolder().folder) in line
    assert " 5 of " in line  # four drops and their session
    assert "kept results: ok: 0 of " in call("doctor", "--clear-cache", code={0, 4}).out


def test_a_blind_session_keeps_no_numbers(tmp_path, call):
    text = (PROTOCOLS / "picket-fence.yaml").read_text("utf-8")
    path = record(tmp_path, f"{text}\nblind: true\n", "sim://?seed=3")
    assert len(CacheFolder().sizes()) == 1
    assert not any("gravity_m_s2" in run.quantities for run in analysed(path).runs)
    call("unblind", path)
    assert analysed(path).runs[0].gravity.u > 0.0
