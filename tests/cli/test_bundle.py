"""A session as a bundle: the same bytes twice, and no byte of it altered unseen."""

import csv
import hashlib
import io
import json
import os
import random
import re
import shutil
import sqlite3
import zipfile
from contextlib import closing

import pytest

from rig.bundle.archive import CRATE, ROOT, SUMS, list_hashes, pack, read_bundle
from rig.bundle.contents import ENVIRONMENT, RESULTS, SESSION
from rig.commands import bundling
from rig.errors import InputError
from tests.cli.lab import PROTOCOLS, short
from tests.once import once
from tests.session.altering import alter, unguarded
from tests.tables import cases

pytestmark = pytest.mark.usefixtures("undrawn")
DERIVE = once(bundling.derive_bundle)
FLIPS = int(os.environ.get("RIG_FLIPS", "60"))


@pytest.fixture(scope="module")
def bundle(fences, undrawn, tmp_path_factory):
    from rig.cli import main

    path = tmp_path_factory.mktemp("bundle") / "fences.eln"
    assert main(["export", str(fences), "--bundle", str(path)]) == 0
    return path


@pytest.fixture
def derived_once(monkeypatch):
    """Have nothing derived again where what is tested comes after that."""
    monkeypatch.setattr(bundling, "derive_bundle", DERIVE)


@pytest.fixture
def files(bundle):
    return read_bundle(bundle)[0]


def forge(path, files):
    """Write a bundle whose hashes are right, as a forger would."""
    path.write_bytes(pack(list_hashes({n: data for n, data in files.items() if n != SUMS})))


def test_the_same_session_gives_the_same_bytes(bundle, fences, call, tmp_path):
    again, copy = tmp_path / "again.eln", tmp_path / "under another name"
    shutil.copy(fences, copy)
    with closing(sqlite3.connect(copy)) as connection:
        # Pages are elsewhere now, and the last ones are in the log beside the file.
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("VACUUM")
        before = {end: copy.with_name(copy.name + end).read_bytes() for end in ("", "-wal")}
    for end, data in before.items():
        copy.with_name(copy.name + end).write_bytes(data)
    call("export", copy, "--bundle", again)
    assert again.read_bytes() == bundle.read_bytes()
    for end, data in before.items():
        assert copy.with_name(copy.name + end).read_bytes() == data


@pytest.mark.usefixtures("derived_once")
def test_a_bundle_is_as_recorded_whole_or_unpacked(bundle, call, tmp_path):
    done = call("verify", bundle)
    assert done.err == ""
    for words in ("all digits agree", "signature: none", "numpy", "first run: yes\n"):
        assert words in done.out
    assert done.out.endswith("verdict: as recorded\n")
    with zipfile.ZipFile(bundle) as archive:
        assert archive.testzip() is None
        archive.extractall(tmp_path)
    call("verify", tmp_path)
    (tmp_path / ROOT / "more.txt").write_text("x")
    assert f"more.txt is not as {SUMS} has it" in call("verify", tmp_path / ROOT, code=3).out
    assert "5 drops: no gap" in call("verify", tmp_path / ROOT / SESSION).out


def test_other_programs_can_read_what_is_in_it(files):
    graph = {row["@id"]: row for row in json.loads(files[CRATE])["@graph"]}
    assert {part["@id"][2:] for part in graph["./"]["hasPart"]} == files.keys() - {SUMS, CRATE}
    for name in files.keys() - {SUMS, CRATE}:
        row = graph[f"./{name}"]
        digest, size = hashlib.sha256(files[name]).hexdigest(), str(len(files[name]))
        assert (row["sha256"], row["contentSize"]) == (digest, size)
    for resource in json.loads(files["tables/datapackage.json"])["resources"]:
        text = files[f"tables/{resource['path']}"].decode()
        header, *rows = csv.reader(io.StringIO(text))
        fields = resource["schema"]["fields"]
        assert header == [field["name"] for field in fields]
        for row in rows:
            for field, cell in zip(fields, row, strict=True):
                if cell and field["type"] != "string":
                    {"integer": int, "number": float}[field["type"]](cell)
    (mean,) = csv.DictReader(io.StringIO(files["tables/means.csv"].decode()))
    summary = json.loads(files[RESULTS])["summary"][0][mean["quantity"]]
    assert (float(mean["value"]), float(mean["degrees"]) >= 1.0) == (summary["value"], True)


def test_a_byte_altered_anywhere_is_found_and_named(bundle, tmp_path):
    data, chance = bundle.read_bytes(), random.Random(38)
    altered = tmp_path / "altered.eln"
    with zipfile.ZipFile(bundle) as archive:
        members, directory = archive.infolist(), archive.start_dir
    for at in [directory + 4, len(data) - 1, *(chance.randrange(len(data)) for _ in range(FLIPS))]:
        flipped = bytearray(data)
        flipped[at] ^= chance.randrange(1, 256)
        altered.write_bytes(flipped)
        name = [m.filename for m in members if m.header_offset <= at % directory][-1].removeprefix(
            ROOT
        )
        try:
            faults = read_bundle(altered)[1]
        except InputError:  # its directory names no files any more
            assert at >= directory, at
            continue
        # A file's size in the directory makes another file of it.
        assert faults, at
        # A directory that does not begin as one names no file.
        assert at >= directory != at - 4 or any(name in fault for fault in faults), (at, faults)
    altered.write_bytes(data + b"\0")
    assert read_bundle(altered)[1]


@cases
def test_an_altered_row_is_named_even_where_all_is_hashed_anew(sql, named, files, call, tmp_path):
    session, altered = tmp_path / "session", tmp_path / "altered.eln"
    session.write_bytes(files[SESSION])
    alter(session, sql)
    forge(altered, {**files, SESSION: session.read_bytes()})
    for file in (altered, session):
        assert named in call("verify", file, code=3).out


def test_limits_that_changed_after_the_first_run_are_told(files, call, tmp_path):
    session = tmp_path / "changed"
    session.write_bytes(files[SESSION])
    with unguarded(session) as connection:
        (text,) = connection.execute("SELECT text FROM protocol").fetchone()
        other = text.replace("repeats: 5", "repeats: 20")
        connection.execute("UPDATE protocol SET text = ?", (other,))
        digest = hashlib.sha256(other.encode()).hexdigest()
        connection.execute("UPDATE meta SET value = ? WHERE key = 'protocol_sha256'", (digest,))
    done = call("verify", session, code=3)
    assert "limits were fixed before the first run: no\n" in done.out
    assert "table protocol: not as recorded" in done.out


@pytest.mark.usefixtures("derived_once")
def test_numbers_that_do_not_follow_from_the_edges_are_named(files, call, tmp_path):
    forged = tmp_path / "forged.eln"
    results = json.loads(files[RESULTS])
    results["runs"][2]["gravity_m_s2"]["value"] *= 1.0 + 1e-4
    summary = b"9" + files["tables/summary.csv"]
    forge(forged, {**files, RESULTS: json.dumps(results).encode(), "tables/summary.csv": summary})
    done = call("verify", forged, code=3)
    assert "all hashes agree" in done.out
    assert f"{RESULTS}, runs.2.gravity_m_s2.value: " in done.out
    assert f"tables/summary.csv does not follow from {SESSION}" in done.out


@pytest.mark.usefixtures("derived_once")
def test_other_versions_may_differ_in_the_last_digits(files, call, tmp_path):
    other, results = tmp_path / "other.eln", json.loads(files[RESULTS])
    results["runs"][2]["gravity_m_s2"]["value"] *= 1.0 + 5e-10
    environment = files[ENVIRONMENT].replace(b'"numpy": "', b'"numpy": "1')
    forge(other, {**files, RESULTS: json.dumps(results).encode(), ENVIRONMENT: environment})
    assert "9 digits agree" in call("verify", other).out


@cases
def test_what_is_no_bundle_is_refused_in_words(kind, said, bundle, call, tmp_path):
    path, data = tmp_path / "made.eln", bundle.read_bytes()
    if kind == "folder":
        path = tmp_path
    elif kind == "cut":
        path.write_bytes(data[:1000])
    elif kind == "misled":  # where its directory begins: files are then looked for elsewhere
        path.write_bytes(data[:-6] + b"\1" * 4 + bytes(2))
    elif kind != "absent":
        name, how = ("a", zipfile.ZIP_DEFLATED) if kind == "packed" else ("../../a", 0)
        with zipfile.ZipFile(path, "w", how) as made:
            made.writestr(f"record/{name}", bytes(10**6))
    done = call("verify", path, code=2)
    assert str(path) in done.err
    assert "hint: " in done.err
    assert said in done.err


@pytest.mark.usefixtures("analysed_once")
@pytest.mark.parametrize("name", ["two chains", "ball", "blind"])
def test_every_scene_has_a_bundle(name, call, tmp_path, request):
    if name != "two chains":  # their numbers come again as those of chains and fences do
        request.getfixturevalue("derived_once")
    text = {
        "two chains": short(repeats=1),
        "ball": (PROTOCOLS / "falling-ball.yaml").read_text("utf-8"),
        "blind": short("[40 deg]", 2) + "\nblind: true\n",
    }[name]
    protocol, session, path = (tmp_path / each for each in ("p.yaml", "p.session", "p.eln"))
    protocol.write_text(re.sub(r"repeats: \d+", "repeats: 2", text), "utf-8")
    call("run", protocol, "--port", "sim://?seed=5", "--session", session, "--yes", code={0, 3})
    call("export", session, "--bundle", path)
    done = call("verify", path)
    assert "all digits agree" in done.out
    files = read_bundle(path)[0]
    if name == "two chains":
        means = csv.DictReader(io.StringIO(files["tables/means.csv"].decode()))
        u = {(row["incline_deg"], row["quantity"]): float(row["u"]) for row in means}
        rows = [*csv.DictReader(io.StringIO(files["tables/covariances.csv"].decode()))]
        assert len(rows) == 4, "of two quantities at two inclines each"
        for row in rows:
            first, second = ((row["incline_deg" + n], row["quantity" + n]) for n in ("", "_2"))
            assert 0.0 < abs(float(row["covariance"])) < u[first] * u[second]
            assert first[0] != second[0]
    if name == "blind":
        for file in files.keys() - {SESSION}:
            assert b"separation_m" not in files[file], file
        assert "blind session: still blind" in done.out
        call("unblind", session)
        call("export", session, "--bundle", path)
        assert "blind session: unblinded 2" in call("verify", path).out
        assert b"separation_m" in read_bundle(path)[0][RESULTS]
    if name == "ball":
        for file in ("tables/means.csv", "README.txt"):
            assert b"incline" not in files[file]
            assert b"chain" not in files[file].replace(b"chainrig", b"")


@pytest.mark.usefixtures("derived_once")
def test_a_signature_is_checked(bundle, fences, call, tmp_path):
    minisign = pytest.importorskip("minisign")
    pair = minisign.KeyPair.generate()
    key, public, other = (tmp_path / name for name in ("my.key", "my.pub", "other.pub"))
    key.write_bytes(bytes(pair.secret_key) + b"\n")
    public.write_bytes(bytes(pair.public_key) + b"\n")
    other.write_bytes(bytes(minisign.KeyPair.generate().public_key) + b"\n")
    path = tmp_path / "signed.eln"
    call("export", fences, "--bundle", path, "--sign", key)
    assert "signature: right" in call("verify", path, "--key", public).out
    call("verify", path)
    call("verify", path, "--key", other, code=3)
    call("verify", bundle, "--key", public, code=3)
    call("verify", path, "--key", path, code=2)
    call("export", fences, "--csv", tmp_path, "--sign", key, code=2)
    first = path.read_bytes()
    call("export", fences, "--bundle", path, "--sign", key)
    assert path.read_bytes() == first
    at = first.index(b"untrusted comment", first.index(b".minisig")) + 20
    path.write_bytes(first[:at] + b"X" + first[at + 1 :])
    call("verify", path, code=3)


def test_notes_and_files_change_no_verdict_and_travel(fences, call, tmp_path):
    session, photo = tmp_path / "my.session", tmp_path / "rig µ.jpg"
    shutil.copy(fences, session)
    photo.write_bytes(b"\xff\xd8 a photograph")
    before = [run["verdict"] for run in call("analyze", session, "--json").json["runs"]]
    call("notes", session, "--run", 3, "the magnet let go late")
    call("attach", session, photo)
    after = [run["verdict"] for run in call("analyze", session, "--json").json["runs"]]
    assert after == before
    call("export", session, "--bundle", tmp_path / "b.eln")
    assert read_bundle(tmp_path / "b.eln")[0]["attached/1-rig_µ.jpg"] == photo.read_bytes()
