"""``rig replay`` believes nothing: a changed byte, edge, clock sample or result is found."""

import shutil

import pytest

from tests.session.altering import unguarded


@pytest.fixture
def fenced(fences, tmp_path):
    """Copy a session that is quickly analysed."""
    return shutil.copy(fences, tmp_path / "copy.session")


def tamper(session, sql, *values):
    """Change a session behind its back, guards taken away first."""
    with unguarded(session) as connection:
        assert connection.execute(sql, values).rowcount == 1


@pytest.mark.parametrize(
    ("sql", "found"),
    [
        ('UPDATE edge SET tick = tick + 1 WHERE "drop" = 2 AND idx = 10', {"drops", "results"}),
        ('UPDATE "drop" SET release_sense = 3 WHERE id = 2', {"drops"}),
        ('UPDATE edge SET channel = 1 - channel WHERE "drop" = 1 AND idx = 0', {"drops"}),
        ('UPDATE "drop" SET fire_tick = fire_tick + 1 WHERE run = 3', {"drops"}),
        ('UPDATE "drop" SET faults = \'["late"]\' WHERE run = 4', {"drops", "results"}),
        ("UPDATE ping SET tick = tick + 500 WHERE id = 1", {"clock samples", "results"}),
        ("DELETE FROM ping WHERE id = 2", {"clock samples", "results"}),
        ("UPDATE bytes SET host_ns = host_ns + 1 WHERE id = (SELECT max(id) FROM bytes)", set()),
    ],
)
def test_what_was_tampered_with_is_called_different(call, fenced, sql, found):
    tamper(fenced, sql)
    done = call("replay", fenced)
    *lines, last = done.out.splitlines()
    different = {line.partition(":")[0] for line in lines if line.endswith("DIFFERENT")}
    assert different >= found
    assert different - found <= {"results"}
    assert done.code == (1 if different else 0)
    assert last == (
        f"DIFFERENT: {', '.join(line.partition(':')[0] for line in lines if 'DIFF' in line)}"
        if different
        else "identical"
    )
