"""Atomic writes: the old file or the new one."""

from pathlib import Path
from unittest.mock import Mock

from rig.errors import InputError
from rig.files import write_atomic
from tests.refusals import refused


def test_replaces_and_leaves_nothing_else(tmp_path):
    path = tmp_path / ("n" * 255)
    write_atomic(path, "old")
    write_atomic(path, "new\r\nµ")
    assert path.read_bytes() == "new\r\nµ".encode()
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_stays_a_link(tmp_path):
    target = tmp_path / "target"
    target.write_text("old")
    link = tmp_path / "link"
    link.symlink_to(target)
    write_atomic(link, "new")
    assert link.is_symlink()
    assert target.read_text() == "new"


def test_devices_are_written_through():
    write_atomic("/dev/null", "text")
    assert not Path("/dev/null").is_file()


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "report.html"
    path.write_text("old")

    full = Mock(side_effect=OSError(28, "No space left on device"))
    monkeypatch.setattr("rig.files.os.fsync", full)
    assert refused(InputError, "No space left", write_atomic, path, "new").hint
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_places_that_cannot_be_written(tmp_path):
    refused(InputError, "it is a folder", write_atomic, tmp_path, "x")
    refused(InputError, "No such file", write_atomic, tmp_path / "no" / "file", "x")
