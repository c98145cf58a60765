"""The cache: what was kept comes back, from a file that anything may happen to."""

import errno
import os
import signal
import subprocess
import sys

import pytest

from rig.cache.store import CacheFolder

WRITER = """
import sys
from pathlib import Path
from rig.cache.store import CacheFolder
cache, name = CacheFolder(Path(sys.argv[1])), sys.argv[2]
for n in range(int(sys.argv[3])):
    cache.put(f"{name} {n}", f"{name} {n} " * 2000)
    if not n:
        print("begun", flush=True)
"""


@pytest.fixture
def cache(tmp_path):
    return CacheFolder(tmp_path / "cache")


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
    assert len(cache.sizes()) == 1
    cache.clear()
    assert (cache.get("a"), len(cache.sizes())) == (None, 0)


def test_what_stands_beside_it_stays(cache):
    """Without XDG_RUNTIME_DIR a daemon has its socket in the same folder."""
    cache.put("a", "1")
    for name in ("rig.sock", "results.sqlite"):  # an earlier version kept all in a database
        (cache.folder / name).touch()
    assert len(cache.sizes()) == 2
    cache.clear()
    assert [file.name for file in cache.folder.glob("*.*")] == ["rig.sock"]


def test_behind_a_link_it_is_forgotten_and_used_again(tmp_path, cache):
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    cache.folder.symlink_to(tmp_path / "elsewhere")
    cache.put("a", "1")
    cache.clear()
    assert (cache.get("a"), len(cache.sizes())) == (None, 0)
    cache.put("a", "2")
    assert cache.get("a") == "2"


def test_what_a_full_disk_cut_off_takes_no_room(cache, monkeypatch):
    def write_half(path, data):
        path.write_text("half")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("pathlib.Path.write_bytes", write_half)
    cache.put("a", "1")
    assert (cache.get("a"), sum(cache.sizes())) == (None, 0)


def test_it_is_for_this_user_alone(cache):
    cache.put("a", "1")
    assert cache.folder.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("damage", [b"", b"no zlib", "cut", "altered"])
def test_what_was_damaged_is_none_until_it_is_kept_anew(cache, damage):
    text = "".join(map(str, range(3000)))
    cache.put("key", text)
    (path,) = cache.folder.glob("*/*")
    data = path.read_bytes()
    middle = len(data) // 2
    altered = {"cut": data[:middle], "altered": data[:middle] + b"x" + data[middle + 1 :]}
    path.write_bytes(altered.get(damage, damage))
    assert cache.get("key") is None
    cache.put("key", text)
    assert cache.get("key") == text


def test_it_is_bounded_and_forgets_where_it_is_full(tmp_path):
    cache = CacheFolder(tmp_path / "cache", most_bytes=1_000_000)
    for n in range(200):
        cache.put(f"{n}", os.urandom(10_000).hex())
        assert cache.get(f"{n}") is not None
        assert 10_000 < sum(cache.sizes()) <= 1_000_000
    assert 20 < len(cache.sizes()) < 200
    assert any(cache.get(f"{n}") is None for n in range(100))
    cache.put("large", os.urandom(400_000).hex())
    assert cache.get("large") is None
    cache.put("large", "text")
    assert cache.get("large") == "text"


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
        CacheFolder(folder).put("a", "1")
        folder.chmod(0o777)
    else:
        folder = folder.relative_to(tmp_path)
    cache = CacheFolder(folder)
    cache.put("a", "1")
    assert (cache.get("a"), cache.sizes()) == (None, None)
    cache.clear()
