"""A session as a bundle: the same bytes twice, and no byte of it altered unseen."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import random
import re
import shutil
import sqlite3
import zipfile
from contextlib import closing

import pytest

from rig.bundle.archive import ROOT, SUMS, pack, read_bundle
from rig.bundle.check import check_hashes
from rig.bundle.contents import ENVIRONMENT, RESULTS, SESSION
from rig.bundle.crate import CRATE
from rig.session.store import Session
from tests.cli.lab import PROTOCOLS, short
from tests.session.altering import unguarded

FLIPS = 60
TABLES = "experiment/tables/"


@pytest.fixture(scope="module")
def bundle(fences, tmp_path_factory):
    from rig.cli import main

    path = tmp_path_factory.mktemp("bundle") / "fences.eln"
    assert main(["export", str(fences), "--bundle", str(path)]) == 0
    return path


@pytest.fixture
def files(bundle):
    return dict(read_bundle(bundle).files)


def sealed(files):
    """Make a bundle whose hashes are right, as a forger would."""
    rest = {name: files[name] for name in files if name not in {SUMS, CRATE}}
    graph = json.loads(files[CRATE])
    for row in graph["@graph"]:
        if "sha256" in row:
            row["sha256"] = hashlib.sha256(rest[row["@id"][2:]]).hexdigest()
    rest[CRATE] = json.dumps(graph).encode()
    lines = [f"{hashlib.sha256(rest[name]).hexdigest()}  {name}\n" for name in sorted(rest)]
    return pack(rest | {SUMS: "".join(lines).encode()})


def test_the_same_session_gives_the_same_bytes(bundle, fences, call, tmp_path):
    again, original = tmp_path / "again.eln", fences.read_bytes()
    copy = tmp_path / "under another name"
    shutil.copy(fences, copy)
    with closing(sqlite3.connect(copy)) as connection:
        # Pages are elsewhere now, and the last ones are in the log beside the file.
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("VACUUM")
        kept = {end: copy.with_name(copy.name + end).read_bytes() for end in ("", "-wal")}
    for end, data in kept.items():
        copy.with_name(copy.name + end).write_bytes(data)
    assert kept["-wal"]
    done = call("export", copy, "--bundle", again)
    assert done.code == 0, done.err
    assert again.read_bytes() == bundle.read_bytes()
    assert fences.read_bytes() == original
    for end, data in kept.items():
        assert copy.with_name(copy.name + end).read_bytes() == data


def test_a_bundle_is_as_recorded(bundle, call, tmp_path):
    done = call("verify", bundle)
    assert (done.code, done.err) == (0, ""), done
    assert "all digits agree" in done.out
    assert "signature: none" in done.out
    assert "numpy" in done.out
    assert done.out.endswith("verdict: as recorded\n")
    with zipfile.ZipFile(bundle) as archive:
        assert archive.testzip() is None
        archive.extractall(tmp_path)
    assert call("verify", tmp_path).code == 0, "the folder that it was unpacked into"
    assert call("verify", tmp_path / ROOT).code == 0
    (tmp_path / ROOT / "experiment/more.txt").write_text("x")
    done = call("verify", tmp_path)
    assert (done.code, f"experiment/more.txt is not in {SUMS}" in done.out) == (3, True)
    done = call("verify", tmp_path / ROOT / SESSION)
    assert (done.code, "drops: 10, 0 damaged" in done.out) == (0, True)


def test_other_programs_can_read_what_is_in_it(files):
    sums = dict(reversed(line.split("  ")) for line in files[SUMS].decode().splitlines())
    assert sums == {n: hashlib.sha256(files[n]).hexdigest() for n in files if n != SUMS}
    graph = {row["@id"]: row for row in json.loads(files[CRATE])["@graph"]}
    assert graph[CRATE]["about"] == {"@id": "./"}
    parts = [part["@id"] for row in ("./", "./experiment/") for part in graph[row]["hasPart"]]
    assert {part[2:] for part in parts} == files.keys() - {SUMS, CRATE} | {"experiment/"}
    for name in files.keys() - {SUMS, CRATE}:
        row = graph[f"./{name}"]
        digest, size = hashlib.sha256(files[name]).hexdigest(), str(len(files[name]))
        assert (row["sha256"], row["contentSize"]) == (digest, size)
    package = json.loads(files[f"{TABLES}datapackage.json"])
    for resource in package["resources"]:
        text = files[TABLES + resource["path"]].decode()
        header, *rows = csv.reader(io.StringIO(text))
        fields = resource["schema"]["fields"]
        assert header == [field["name"] for field in fields]
        for row in rows:
            for field, cell in zip(fields, row, strict=True):
                if cell and field["type"] != "string":
                    {"integer": int, "number": float}[field["type"]](cell)
    (mean,) = csv.DictReader(io.StringIO(files[f"{TABLES}means.csv"].decode()))
    assert float(mean["degrees"]) >= 1.0
    summary = json.loads(files[RESULTS])["summary"][0][mean["quantity"]]
    assert float(mean["value"]) == summary["value"]


def test_a_byte_altered_anywhere_is_found_and_named(bundle, tmp_path):
    data, chance = bundle.read_bytes(), random.Random(38)
    altered = tmp_path / "altered.eln"
    with zipfile.ZipFile(bundle) as archive:
        members, directory = archive.infolist(), archive.start_dir
    for _ in range(FLIPS):
        at = chance.randrange(directory)
        flipped = bytearray(data)
        flipped[at] ^= chance.randrange(1, 256)
        altered.write_bytes(flipped)
        contents = read_bundle(altered)
        (fault, *_) = check_hashes(contents.files) or contents.faults
        name = [m.filename for m in members if m.header_offset <= at][-1].removeprefix(ROOT)
        assert name in fault, (at, fault)


def test_an_altered_directory_is_found(bundle, call, tmp_path):
    data, chance = bundle.read_bytes(), random.Random(7)
    altered = tmp_path / "altered.eln"
    with zipfile.ZipFile(bundle) as archive:
        begin = archive.start_dir
    for at in (begin, len(data) - 1, *(chance.randrange(begin, len(data)) for _ in range(4))):
        flipped = bytearray(data)
        flipped[at] ^= 1 << chance.randrange(8)
        altered.write_bytes(flipped)
        assert call("verify", altered).code in {2, 3}, at
    altered.write_bytes(data + b"\0")
    done = call("verify", altered)
    assert (done.code, "archive" in done.out) == (3, True)


@pytest.mark.parametrize(
    ("sql", "named"),
    [
        ('UPDATE edge SET tick = tick + 1 WHERE "drop" = 3 AND idx = 2', "run 3, attempt 1"),
        ("UPDATE ping SET tick = tick + 1 WHERE id = 4", "table ping"),
        ("DELETE FROM run_state WHERE id = 5", "table run_state"),
        ("UPDATE meta SET value = 'x' WHERE key = 'origin'", "table meta"),
    ],
)
def test_an_altered_row_is_named(sql, named, files, bundle, call, tmp_path):
    session, altered = tmp_path / "session", tmp_path / "altered.eln"
    session.write_bytes(files[SESSION])
    with unguarded(session) as connection:
        connection.execute(sql)
    files[SESSION] = session.read_bytes()
    altered.write_bytes(pack(files))
    done = call("verify", altered)
    assert done.code == 3
    assert f"{SESSION} was altered: {named}\n" in done.out
    assert read_bundle(altered).files.keys() == read_bundle(bundle).files.keys()


def test_numbers_that_do_not_follow_from_the_edges_are_named(files, call, tmp_path):
    results = json.loads(files[RESULTS])
    quantity = results["runs"][2]["gravity_m_s2"]
    quantity["value"] *= 1.0 + 1e-4
    files[RESULTS] = json.dumps(results).encode()
    table = files[f"{TABLES}summary.csv"].decode().splitlines()
    files[f"{TABLES}summary.csv"] = "\n".join([table[0], "9" + table[1], ""]).encode()
    forged = tmp_path / "forged.eln"
    forged.write_bytes(sealed(files))
    done = call("verify", forged)
    assert done.code == 3
    assert "hashes agree" in done.out
    assert f"{RESULTS}, runs.2.gravity_m_s2.value: " in done.out
    assert f"{TABLES}summary.csv, line 2, " in done.out


def test_other_versions_may_differ_in_the_last_digits(files, call, tmp_path):
    results = json.loads(files[RESULTS])
    results["runs"][2]["gravity_m_s2"]["value"] *= 1.0 + 1e-9
    files[RESULTS] = json.dumps(results).encode()
    files[ENVIRONMENT] = files[ENVIRONMENT].replace(b'"numpy": "', b'"numpy": "1')
    other = tmp_path / "other.eln"
    other.write_bytes(sealed(files))
    done = call("verify", other)
    assert done.code == 0, done
    assert ("all digits agree" in done.out, "digits agree" in done.out) == (False, True)


def archive(folder, *members, how=zipfile.ZIP_STORED):
    path = folder / "made.eln"
    with zipfile.ZipFile(path, "w", how) as made:
        for name, content in members:
            made.writestr(name, content)
    return path


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda folder, _: folder / "absent.eln", "No such file"),
        (lambda folder, _: folder, "no record/SHA256SUMS"),
        (lambda folder, _: archive(folder), "no record/SHA256SUMS"),
        (lambda folder, _: archive(folder, ("other/a.json", "{}")), "outside of record/"),
        (lambda folder, _: archive(folder, ("record/../../a", "x")), "outside of record/"),
        (
            lambda folder, _: archive(folder, ("record/a", bytes(10**7)), how=zipfile.ZIP_DEFLATED),
            "is compressed",
        ),
        (lambda folder, whole: cut(folder, whole, 0), "cannot be read"),
        (lambda folder, whole: cut(folder, whole, 1000), "cannot be read"),
        (lambda folder, whole: cut(folder, whole, -10), "cannot be read"),
    ],
)
def test_what_is_no_bundle_is_refused_in_words(make, said, bundle, call, tmp_path):
    path = make(tmp_path, bundle)
    done = call("verify", path)
    assert done.code == 2, done
    assert str(path) in done.err
    assert said in done.err
    assert "hint: " in done.err


def cut(folder, whole, size):
    path = folder / "cut.eln"
    path.write_bytes(whole.read_bytes()[:size])
    return path


SCENES = {
    "two chains": short(repeats=1),
    "ball": (PROTOCOLS / "falling-ball.yaml").read_text("utf-8"),
    "glider": (PROTOCOLS / "glider.yaml").read_text("utf-8"),
    "single chain": (PROTOCOLS / "single-chain.yaml").read_text("utf-8"),
    "blind": short("[40 deg]", 2) + "\nblind: true\n",
}


@pytest.mark.usefixtures("analysed_once")
@pytest.mark.parametrize("name", SCENES)
def test_every_scene_has_a_bundle(name, call, tmp_path):
    protocol, session, path = (tmp_path / each for each in ("p.yaml", "p.session", "p.eln"))
    protocol.write_text(re.sub(r"repeats: \d+", "repeats: 2", SCENES[name]), "utf-8")
    ran = call("run", protocol, "--port", "sim://?seed=5", "--session", session, "--yes")
    assert ran.code in {0, 3}, ran.err
    done = call("export", session, "--bundle", path)
    assert done.code == 0, done.err
    done = call("verify", path)
    assert (done.code, "all digits agree" in done.out) == (0, True), done.out
    files = read_bundle(path).files
    if name == "two chains":
        means = csv.DictReader(io.StringIO(files[f"{TABLES}means.csv"].decode()))
        u = {(row["incline_deg"], row["quantity"]): float(row["u"]) for row in means}
        rows = [*csv.DictReader(io.StringIO(files[f"{TABLES}covariances.csv"].decode()))]
        assert len(rows) == 4, "of two quantities at two inclines each"
        for row in rows:
            one, other = ((row["incline_deg" + n], row["quantity" + n]) for n in ("", "_2"))
            assert 0.0 < abs(float(row["covariance"])) < u[one] * u[other]
            assert one[0] != other[0]
    if name == "blind":
        for file, data in files.items():
            if file != SESSION:
                assert b"separation_m" not in data, file
                assert b"speed_m_s" not in data, file
        assert "still blind" in done.out
    if name in {"ball", "glider"}:
        for file in (f"{TABLES}means.csv", "experiment/README.txt"):
            assert b"incline" not in files[file]
            assert b"chain" not in files[file].replace(b"chainrig", b"")


def test_a_bundle_of_a_damaged_record_says_so(fences, call, tmp_path):
    session, path = tmp_path / "damaged", tmp_path / "damaged.eln"
    shutil.copy(fences, session)
    with unguarded(session) as connection:
        connection.execute('DELETE FROM edge WHERE "drop" = 4 AND idx = 1')
    assert call("export", session, "--bundle", path).code == 3
    for file in (path, session):
        done = call("verify", file)
        assert (done.code, "run 4, attempt 1" in done.out) == (3, True), done


def test_an_imported_session_has_a_bundle(fences, call, tmp_path):
    assert call("export", fences, "--csv", tmp_path).code == 0
    session, path = tmp_path / "imported", tmp_path / "imported.eln"
    protocol = PROTOCOLS / "picket-fence.yaml"
    done = call("import", tmp_path / "edges.csv", "--protocol", protocol, "--session", session)
    assert done.code == 0, done.err
    assert call("export", session, "--bundle", path).code == 0
    done = call("verify", path)
    assert (done.code, "all digits agree" in done.out) == (0, True), done.out


def test_a_signature_is_checked(files, bundle, fences, call, tmp_path):
    minisign = pytest.importorskip("minisign")
    pair = minisign.KeyPair.generate()
    key, public, other = (tmp_path / name for name in ("my.key", "my.pub", "other.pub"))
    key.write_bytes(bytes(pair.secret_key) + b"\n")
    public.write_bytes(bytes(pair.public_key) + b"\n")
    other.write_bytes(bytes(minisign.KeyPair.generate().public_key) + b"\n")
    path = tmp_path / "signed.eln"
    done = call("export", fences, "--bundle", path, "--sign", key)
    assert done.code == 0, done.err
    done = call("verify", path, "--key", public)
    assert (done.code, "signature: right" in done.out) == (0, True), done.out
    assert call("verify", path).code == 0
    assert call("verify", path, "--key", other).code == 3
    assert call("verify", bundle, "--key", public).code == 3
    assert call("verify", path, "--key", path).code == 2
    first = path.read_bytes()
    assert call("export", fences, "--bundle", path, "--sign", key).code == 0
    assert path.read_bytes() == first
    at = first.index(b"untrusted comment", first.index(b".minisig")) + 20
    path.write_bytes(first[:at] + b"X" + first[at + 1 :])
    assert call("verify", path).code == 3


def test_the_copy_in_a_bundle_is_the_session(files, fences, tmp_path):
    copy = tmp_path / "copy"
    copy.write_bytes(files[SESSION])
    with Session.open(copy, readonly=True) as one, Session.open(fences, readonly=True) as other:
        assert [*one.drops()] == [*other.drops()]
        assert [*one.byte_log()] == [*other.byte_log()]
        assert (one.pings(), one.states()) == (other.pings(), other.states())
        assert one.meta == other.meta
