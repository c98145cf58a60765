"""Whoever computes: the same bits, an end in time, and nobody left behind."""

import os
import signal
import socket
import subprocess
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from rig.protocol import reader
from rig.sweep import executor as module
from rig.sweep.compute import compute
from rig.sweep.executor import executor
from rig.sweep.layout import lay_out
from tests.cli.lab import PROTOCOLS, ROOT, command
from tests.sweep.conftest import SCENE, VARY
from tests.waiting import PATIENCE_S


@pytest.fixture(scope="module")
def layout():
    return lay_out(reader.parse(SCENE), VARY)


@pytest.fixture(scope="module")
def wanted(layout):
    return computed(layout, layout.size)


def computed(layout, length, threads=1, show=lambda _: None):
    with ThreadPoolExecutor(threads) as pool:
        return compute(layout, pool, 2 * threads - 1, length, show)


@pytest.fixture(scope="module")
def cluster():
    from distributed import LocalCluster  # takes half a second, which collecting need not

    return LocalCluster


@pytest.fixture(scope="module")
def local(cluster):
    with cluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as local:
        yield local


def assert_same(found, wanted):
    for name in ("separation_m", "speed_m_s", "notes"):
        assert getattr(found, name).tobytes() == getattr(wanted, name).tobytes(), name


@pytest.mark.parametrize("length", [1, 7, 64, 10**6])
def test_how_a_grid_is_cut_does_not_show(layout, wanted, length):
    assert_same(computed(layout, length), wanted)


def test_threads_and_a_cluster_give_the_same_bits(layout, wanted, local):
    assert np.isfinite(wanted.speed_m_s).any()
    assert_same(computed(layout, 11, threads=3), wanted)
    with executor(None, local.scheduler_address) as (pool, count):
        assert count == 2
        assert_same(compute(layout, pool, 4, 23), wanted)


def test_the_command_on_a_cluster_writes_the_same_file(sweep, local, tmp_path):
    sweep("here.csv", *VARY)
    sweep("there.csv", *VARY, more=("--cluster", local.scheduler_address))
    assert (tmp_path / "there.csv").read_bytes() == (tmp_path / "here.csv").read_bytes()


def test_a_cluster_without_workers_is_refused(sweep, cluster):
    with cluster(n_workers=0, processes=False, dashboard_address=":0") as empty:
        there = ("--cluster", empty.scheduler_address)
        assert "no workers" in sweep("x.csv", "friction=0..1:3", more=there, code=4)


@pytest.mark.parametrize("address", ["nonsense", "foo://bar:1", "closed", "silent"])
def test_an_address_where_no_cluster_is(sweep, tmp_path, address, monkeypatch):
    monkeypatch.setattr(module, "PATIENCE_S", 1.0)
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        where = f"tcp://127.0.0.1:{port}" if address in {"closed", "silent"} else address
        if address == "closed":
            server.close()
        said = sweep("x.csv", "friction=0..1:3", more=("--cluster", where), code=4)
    assert said.startswith(f"--cluster {where}: cannot be reached")
    assert len(said.splitlines()) == 2
    assert not (tmp_path / "x.csv").exists()


def test_ctrl_c_ends_a_sweep_and_writes_nothing(tmp_path):
    vary = ("--vary", "drop=0m..1m:2500", "--vary", "friction=0..1:2500", "--vary", "incline=40deg")
    arguments = ("sweep", PROTOCOLS / "single-chain.yaml", *vary, "--jobs", 2)
    with subprocess.Popen(
        command(*arguments, "-o", tmp_path / "x.csv"),
        cwd=ROOT,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        line = process.stderr.readline()  # the first quarter is done
        assert "points" in line
        os.killpg(process.pid, signal.SIGINT)
        assert process.wait(PATIENCE_S) == 130
        assert process.stderr.read().endswith("rig: interrupted; nothing was written\n")
    assert list(tmp_path.iterdir()) == []
