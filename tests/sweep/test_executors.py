"""Whoever computes: the same bits, an end in time, and nobody left behind."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from distributed import LocalCluster

from rig.protocol import reader
from rig.sweep import cluster as dask
from rig.sweep.compute import compute
from rig.sweep.executors import Inline, WorkersError, processes
from rig.sweep.layout import lay_out
from tests.cli.lab import PROTOCOLS, ROOT, command
from tests.sweep.conftest import SCENE, VARY
from tests.waiting import PATIENCE_S, until


@pytest.fixture(scope="module")
def layout():
    return lay_out(reader.parse(SCENE), VARY)


@pytest.fixture(scope="module")
def wanted(layout):
    return compute(layout, Inline(), 1, layout.grid.size)


@pytest.fixture(scope="module")
def local():
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as local:
        yield local


def assert_same(found, wanted):
    for name in ("separation_m", "speed_m_s", "notes"):
        assert getattr(found, name).tobytes() == getattr(wanted, name).tobytes(), name


@pytest.mark.parametrize("length", [1, 7, 64, 10**6])
def test_how_a_grid_is_cut_does_not_show(layout, wanted, length):
    assert_same(compute(layout, Inline(), 1, length), wanted)


def test_processes_threads_and_a_cluster_give_the_same_bits(layout, wanted, local):
    assert np.isfinite(wanted.speed_m_s).any()
    with ThreadPoolExecutor(3) as pool:
        assert_same(compute(layout, pool, 5, 11), wanted)
    with processes(2) as pool:
        assert_same(compute(layout, pool, 4, 23), wanted)
    with dask.cluster(local.scheduler_address) as (pool, threads):
        assert threads == 2
        assert_same(compute(layout, pool, 4, 23), wanted)


def test_the_command_on_a_cluster_writes_the_same_file(sweep, local, tmp_path):
    assert sweep("here.csv", *VARY).code == 0
    assert sweep("there.csv", *VARY, more=("--cluster", local.scheduler_address)).code == 0
    assert (tmp_path / "there.csv").read_bytes() == (tmp_path / "here.csv").read_bytes()


def test_progress_counts_every_point_once(layout):
    shown: list[int] = []
    compute(layout, Inline(), 1, 100, shown.append)
    assert shown == [*range(100, layout.grid.size, 100), layout.grid.size]


def test_workers_with_another_version_are_refused(layout, local, monkeypatch):
    monkeypatch.setattr(dask, "__version__", "0.0.other")
    with pytest.raises(WorkersError, match=r"0\.0\.other"), dask.cluster(local.scheduler_address):
        pytest.fail("connected")


def test_a_cluster_without_workers_is_refused(sweep):
    with LocalCluster(n_workers=0, processes=False, dashboard_address=":0") as empty:
        done = sweep("x.csv", "friction=0..1:3", more=("--cluster", empty.scheduler_address))
    assert done.code == 4
    assert "no workers" in done.err


@pytest.mark.parametrize("address", ["nonsense", "foo://bar:1", "closed", "silent"])
def test_an_address_where_no_cluster_is(sweep, tmp_path, address, monkeypatch):
    monkeypatch.setattr(dask, "PATIENCE_S", 1.0)
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        where = f"tcp://127.0.0.1:{port}" if address in {"closed", "silent"} else address
        if address == "closed":
            server.close()
        done = sweep("x.csv", "friction=0..1:3", more=("--cluster", where))
    assert done.code == 4
    assert done.err.startswith(f"--cluster {where}: cannot be reached")
    assert len(done.err.splitlines()) == 2
    assert not (tmp_path / "x.csv").exists()


def _die(*_: object) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_process_that_dies_is_told_and_not_waited_for():
    with pytest.raises(WorkersError, match="died"), processes(1) as pool:
        pool.submit(_die).result(PATIENCE_S)


def _children(pid: int) -> list[str]:
    return Path(f"/proc/{pid}/task/{pid}/children").read_text().split()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_the_end_of_the_command_is_the_end_of_all(tmp_path, number):
    vary = ("--vary", "drop=0m..1m:4000", "--vary", "friction=0..1:4000", "--vary", "incline=40deg")
    arguments = ("sweep", PROTOCOLS / "single-chain.yaml", *vary, "--jobs", 2)
    with subprocess.Popen(
        command(*arguments, "-o", tmp_path / "x.csv"),
        cwd=ROOT,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        until(  # the two, and multiprocessing's own
            lambda: process.poll() is not None or len(_children(process.pid)) >= 3
        )
        assert process.poll() is None, process.stderr.read()
        if number == signal.SIGINT:
            os.killpg(process.pid, number)  # as a terminal does: to all of them
        else:
            process.kill()
        code, said = process.wait(PATIENCE_S), process.stderr.read()
    if number == signal.SIGINT:
        assert code == 130
        assert said == "rig: interrupted; nothing was written\n"
    assert list(tmp_path.iterdir()) == []
    until(lambda: not _left(process.pid), lambda: "somebody is left")


def _left(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True
