"""The bulk benchmark: the C loop falls as the model does, and what is printed was counted.

How long anything takes is never tested.
"""

from __future__ import annotations

import json
import os
import sys
from dataclasses import fields

import numpy as np
import pytest

from bench.__main__ import main
from bench.studies import bulk as bench
from rig.errors import RigError
from rig.model.fall import fall

COMPILER = bench.find_compiler()
needs_compiler = pytest.mark.skipif(
    COMPILER is None and not os.environ.get("CI"), reason="there is no C compiler here"
)


@pytest.fixture
def loop(tmp_path):
    return bench.CLoop(COMPILER, tmp_path)


def single(chain, batch, k):
    found = fall(chain, *(float(getattr(batch, field.name)[k]) for field in fields(batch)))
    return found.separation_m, found.speed_m_s, found.time_s


@needs_compiler
def test_the_c_loop_falls_as_the_model_does(loop):
    chain, batch = bench.paper_chain(), bench.varied(300)
    found = np.array(loop.falls(chain, batch))
    wanted = np.array([single(chain, batch, k) for k in range(300)]).T
    # A compiler may fuse a product and a sum into one rounding.
    np.testing.assert_allclose(found, wanted, rtol=2e-14, atol=0.0)


def no_mpmath(monkeypatch):
    monkeypatch.delitem(sys.modules, "rig.bench.reference", raising=False)
    monkeypatch.setitem(sys.modules, "mpmath", None)


@needs_compiler
def test_everything_is_counted_once_a_round(monkeypatch):
    no_mpmath(monkeypatch)
    said = []
    monkeypatch.setattr(bench, "say", said.append)
    found = bench.bulk(40, 3)
    assert (found["rods"], found["falls"], found["rounds"]) == (25, 40, 3)
    assert "-O2" in found["compiler"]
    ratios = "single_over_roots", "single_over_batch", "batch_over_c", "falls_per_s"
    for name in ratios:
        assert 0.0 < found[name]["least"] <= found[name]["median"] <= found[name]["most"]
    assert said == ["no mpmath here: left out the solver"]
    assert "solver_over_single" not in found


def test_the_solver_is_compared_at_rounding(monkeypatch):
    pytest.importorskip("mpmath")
    monkeypatch.setenv("CC", "no-such-compiler")
    monkeypatch.delenv("CI", raising=False)
    found = bench.bulk(5, 1)
    assert found["solver"]["error"] <= bench.AT_ROUNDING
    assert found["solver"]["single_error"] <= bench.AT_ROUNDING
    assert found["solver_over_single"]["median"] > 0.0


def test_in_ci_a_missing_compiler_is_an_error(monkeypatch, capsys):
    monkeypatch.setenv("CC", "no-such-compiler")
    monkeypatch.setenv("CI", "true")
    assert main(["bulk", "--falls", "5", "--rounds", "1"]) == 1
    out, err = capsys.readouterr()
    assert not out
    assert "no C compiler" in err


def test_a_compiler_that_fails_is_an_error(monkeypatch, tmp_path):
    monkeypatch.setenv("CC", "false --quietly")
    with pytest.raises(RigError, match=r"compiler failed: .*false --quietly -O2"):
        bench.CLoop(bench.find_compiler(), tmp_path)


def test_the_command_prints_json_or_a_table(monkeypatch, capsys):
    no_mpmath(monkeypatch)
    monkeypatch.delenv("CI", raising=False)
    assert main(["bulk", "--falls", "5", "--rounds", "1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["falls"] == 5
    assert main(["bulk", "--falls", "5", "--rounds", "1"]) == 0
    table = capsys.readouterr().out
    assert table.startswith("25 rods, batches of 5 falls")
    assert "one fall over 25 square roots" in table
