"""The cache: what was kept comes back, from a file that anything may happen to."""

import os
import signal
import sqlite3
import subprocess
import sys
from contextlib import closing

import pytest

from rig.cache.store import CacheFile

WRITER = """
import sys
from pathlib import Path
from rig.cache.store import CacheFile
cache, name = CacheFile(Path(sys.argv[1])), sys.argv[2]
for n in range(int(sys.argv[3])):
    cache.put(f"{name} {n}", f"{name} {n} " * 2000)
    if not n:
        print("begun", flush=True)
"""


@pytest.fixture
def cache(tmp_path):
    return CacheFile(tmp_path / "cache")


def writer(cache, name, count):
    arguments = [sys.executable, "-c", WRITER, str(cache.folder), name, str(count)]
    return subprocess.Popen(arguments, stdout=subprocess.PIPE)


def whole(cache, name, count):
    """How many entries of a writer are there, each as it was put."""
    texts = [cache.get(f"{name} {n}") for n in range(count)]
    assert all(text in {None, f"{name} {n} " * 2000} for n, text in enumerate(texts))
    return sum(text is not None for text in texts)


def test_what_was_put_last_is_there(cache):
    assert cache.get("a") is None
    for text in ("1 ± 2 \ud800", "3"):
        cache.put("a", text)
        assert cache.get("a") == text
    assert cache.get("b") is None
    assert cache.size().entries == 1
    cache.clear()
    assert (cache.get("a"), cache.size().entries) == (None, 0)


def test_it_is_for_this_user_alone(cache):
    cache.put("a", "1")
    assert cache.folder.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("damage", ["header", "pages", "cut", "text", "foreign", "altered"])
def test_a_damaged_file_is_begun_anew(cache, damage):
    for n in range(50):
        cache.put(f"key {n}", f"{n} " * 20_000 + "".join(map(str, range(n, n + 3000))))
    path = cache.folder / "results.sqlite"
    data = bytearray(path.read_bytes())
    if damage == "header":
        data[:16] = b"x" * 16
    elif damage == "pages":
        data[4096:] = bytes(len(data) - 4096)
    elif damage == "cut":
        del data[len(data) // 2 :]
    elif damage == "text":
        data = b"no database"
    path.write_bytes(data)
    with closing(sqlite3.connect(path)) as connection, connection:
        if damage == "foreign":
            connection.executescript("DROP TABLE entry; CREATE TABLE entry (other)")
        elif damage == "altered":
            connection.execute("UPDATE entry SET packed = zeroblob(length(packed))")
    for n in range(50):
        assert cache.get(f"key {n}") is None or damage in {"pages", "cut"}
    cache.put("key", "text")
    assert cache.get("key") == "text"


def test_it_is_bounded_and_begun_anew_where_it_is_full(tmp_path):
    cache = CacheFile(tmp_path / "cache", most_bytes=300_000)
    for n in range(40):
        cache.put(f"{n}", os.urandom(10_000).hex())
        assert cache.get(f"{n}") is not None
        assert 10_000 < (cache.folder / "results.sqlite").stat().st_size <= 300_000
    assert 10_000 < cache.size().used_bytes <= 300_000
    assert cache.get("0") is None
    cache.put("large", os.urandom(400_000).hex())
    assert cache.size().used_bytes <= 300_000
    cache.put("small", "text")
    assert cache.get("small") == "text"


def test_several_processes_write_at_once(cache):
    writers = [writer(cache, name, 20) for name in "abc"]
    assert [one.wait() for one in writers] == [0, 0, 0]
    assert [whole(cache, name, 20) for name in "abc"] == [20, 20, 20]
    for one in writers:
        one.stdout.close()


def test_who_is_killed_in_the_middle_leaves_whole_entries(cache):
    for _ in range(3):
        with writer(cache, "a", 100_000) as process:
            assert process.stdout.readline() == b"begun\n"
            process.send_signal(signal.SIGKILL)
        assert whole(cache, "a", 50) >= 1
    cache.put("b", "1")
    assert cache.get("b") == "1"


@pytest.mark.parametrize("place", ["file", "shared", "relative"])
def test_a_place_that_cannot_be_used_or_trusted_is_as_an_empty_one(tmp_path, monkeypatch, place):
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "cache"
    if place == "file":
        folder.write_text("")
    elif place == "shared":
        CacheFile(folder).put("a", "1")
        folder.chmod(0o777)
    else:
        folder = folder.relative_to(tmp_path)
    cache = CacheFile(folder)
    cache.put("a", "1")
    assert (cache.get("a"), cache.size()) == (None, None)
    cache.clear()


def test_a_file_that_another_process_has_for_long_is_left_alone(cache, monkeypatch):
    monkeypatch.setattr("rig.cache.store._BUSY_S", 0.01)
    cache.put("a", "1")
    with closing(sqlite3.connect(cache.folder / "results.sqlite")) as other:
        other.execute("BEGIN EXCLUSIVE")
        cache.put("b", "2")
        assert cache.get("a") is None
    assert (cache.get("a"), cache.get("b")) == ("1", None)
