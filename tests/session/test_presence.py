"""A session that is moved, deleted, replaced or cut while it is in use costs nothing."""

import contextlib
import errno
import fcntl
import os
import shutil
from pathlib import Path
from unittest.mock import Mock

import pytest

from bench.mutants import make_session
from bench.process_fixture import FENCE
from rig.errors import DeviceError, SessionError
from rig.files import beside
from rig.recorder.controller import Controller
from rig.recorder.published import PublishedState
from rig.recover.examine import examine
from rig.session.hashes import check_chain
from rig.session.presence import Presence
from rig.session.schema import RunState
from rig.session.store import Session
from tests.cli.lab import drops_of
from tests.programs import run_program
from tests.refusals import refused


def open_files():
    return sorted(path.name for path in Path("/proc/self/fd").iterdir())


def moved(path):
    path.rename(path.with_name("elsewhere"))


def deleted(path):
    path.unlink()


def replaced(path):
    other = path.with_name("other")
    shutil.copy(path, other)
    other.replace(path)


def without_log(path):
    path.with_name(path.name + "-wal").unlink()


WAYS = [moved, deleted, replaced, without_log]


def one_recorded(folder, runs):
    """Have a simulated rig record one of several drops."""
    protocol, session = folder / "fence.yaml", folder / "session"
    protocol.write_text(FENCE.replace("RUNS", str(runs)), "utf-8")
    made = Controller("sim://", PublishedState())
    made.open_session(str(protocol), str(session), 3)
    made.fire(made.arm(1, 1))
    made.collect(1, 1)
    return made, protocol, session


@pytest.fixture
def rig(tmp_path):
    """Have a simulated rig that has recorded one of two drops."""
    made, protocol, session = one_recorded(tmp_path, 2)
    made.log_state(1, 1, RunState.ACCEPTED)
    yield made, protocol, session
    with contextlib.suppress(SessionError):
        made.close()


@pytest.mark.parametrize("lose", WAYS)
def test_nothing_is_armed_and_all_is_saved_beside_it(rig, lose):
    made, protocol, session = rig
    before = made.session.states()
    made.session.log_bytes("rx", 7, b"pending")
    lose(session)
    said = r"everything that was recorded is saved as [^,]*saved-1\n"
    refused(SessionError, said, made.arm, 2, 1)
    assert made.recorder.armed is None
    saved = session.with_name("session.saved-1")
    with Session.open(saved, readonly=True) as found:
        found.check()
        assert found.drop(1, 1) is not None
        assert found.states() == before
        assert [chunk.data for chunk in found.byte_log()].count(b"pending") == 1
    assert check_chain(examine(saved).rows.tables) == []
    with contextlib.suppress(SessionError):
        made.close()
    if lose in {moved, without_log}:  # the file goes on elsewhere, or at its place, whole
        alone = protocol.with_name("alone")
        shutil.copy(session if session.exists() else session.with_name("elsewhere"), alone)
        with Session.open(alone, readonly=True) as found:
            assert found.states() == before
            assert [chunk.data for chunk in found.byte_log()][-1] == b"pending"
    left = {path.name for path in session.parent.iterdir()}
    assert not left & {"session-wal", "session-shm", "session.lock"}
    again = Controller("sim://", PublishedState())
    again.open_session(str(protocol), str(saved))
    again.fire(again.arm(2, 1))
    assert again.collect(2, 1).faults == ()
    again.close()


@pytest.mark.parametrize("lose", WAYS)
def test_a_drop_that_fell_meanwhile_is_saved_before_it_is_acknowledged(rig, lose):
    made, _, session = rig
    made.fire(made.arm(2, 1))
    lose(session)
    refused(SessionError, "while it was in use", made.collect, 2, 1)
    assert drops_of(session.with_name("session.saved-1")) == [(1, 1), (2, 1)]


def test_a_file_that_is_gone_is_noticed_as_its_log_is_merged(rig):
    made, _, session = rig
    session.unlink()
    refused(SessionError, "while it was in use", made.session.settle)


def test_where_its_folder_is_gone_too_all_is_saved_in_the_state_folder(rig, tmp_path, monkeypatch):
    made, _, session = rig
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    lost = tmp_path / "lost"
    made.close()
    lost.mkdir()
    shutil.move(session, lost)
    with Session.open(lost / "session") as opened:
        opened.log_bytes("rx", 7, b"once")
        shutil.rmtree(lost)
        refused(SessionError, r"state/chainrig/session\.saved-1", opened.commit)
        assert opened.rescued
    with Session.open(tmp_path / "state/chainrig/session.saved-1", readonly=True) as found:
        assert found.drop(1, 1) is not None
        assert [chunk.data for chunk in found.byte_log()].count(b"once") == 1


def test_a_session_that_was_cut_is_noticed(rig):
    made, _, session = rig
    os.truncate(session, 4096)
    refused(SessionError, "was cut from", made.arm, 2, 1)


def test_after_an_accepted_run_a_copy_of_the_file_alone_is_whole(rig, tmp_path):
    _, _, session = rig
    alone = tmp_path / "copied"
    shutil.copy(session, alone)
    with Session.open(alone, readonly=True) as found:
        assert found.drop(1, 1) is not None
        assert found.latest_state(1).state is RunState.ACCEPTED


def test_two_names_of_one_file_are_not_both_written(tmp_path):
    session = make_session(tmp_path)
    (tmp_path / "second").hardlink_to(session)
    for name in (session, tmp_path / "second"):
        refused(SessionError, "second name", Session.open, name)
    with Session.open(session, readonly=True) as found:
        found.check()


@pytest.fixture
def disk(tmp_path):
    """Mount a small ext4 of a file; give its folder, and the file by which the kernel fails it."""
    folder, image = tmp_path / "mounted", tmp_path / "ext4"
    folder.mkdir()
    with image.open("wb") as file:
        file.truncate(16 << 20)
    try:
        run_program("mkfs.ext4", "-q", image)
        run_program("mount", "-o", "loop,errors=remount-ro", image, folder)
    except (OSError, AssertionError) as error:  # it takes root and a kernel that knows loop devices
        pytest.skip(f"no disk can be mounted here: {error}")
    source = Path(run_program("findmnt", "-no", "SOURCE", folder).stdout.strip())
    yield folder, Path("/sys/fs/ext4", source.name, "trigger_fs_error")
    run_program("umount", "--lazy", folder)


def test_a_disk_that_can_only_be_read_any_more_leaves_the_drop_on_the_board(disk):
    folder, trigger = disk
    if not os.access(trigger, os.W_OK):
        pytest.skip("no /sys/fs/ext4 here: a disk cannot be made to fail")
    made, _, session = one_recorded(folder, 3)
    made.fire(made.arm(2, 1))
    trigger.write_text("1", "ascii")
    refused(SessionError, "the disk failed under", made.collect, 2, 1)
    refused(DeviceError, "the device still holds the drop of run 2", made.arm, 3, 1)
    refused(SessionError, "the disk failed under", made.close)
    assert drops_of(session) == [(1, 1)]


def test_a_disk_that_knows_no_locks_is_said_to(tmp_path, monkeypatch):
    session = make_session(tmp_path)

    none = OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))
    monkeypatch.setattr(fcntl, "flock", Mock(side_effect=none))
    held = open_files()
    refused(SessionError, "knows no locks", Session.open, session)
    assert open_files() == held


def test_a_session_that_another_writes_costs_no_descriptor(tmp_path):
    session = make_session(tmp_path)
    with Session.open(session):
        held = open_files()
        refused(SessionError, "is being written by process", Session.open, session)
        assert open_files() == held


@pytest.mark.parametrize(("of_another", "rows"), [(True, ""), (False, "rows")])
def test_a_log_of_another_file_or_with_rows_stays(tmp_path, of_another, rows):
    session, other = tmp_path / "s", tmp_path / "other"
    log = beside(session, "-wal")
    for file in (session, log, other):
        file.touch()
    presence = Presence(session)
    if of_another:
        other.replace(log)
    log.write_text(rows)
    presence.remove_log()
    assert log.exists()
