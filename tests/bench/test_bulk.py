"""The bulk benchmark: the C loop falls as the model does, and what is printed was counted.

How long anything takes is never tested.
"""

import json
import os
import sys
from dataclasses import fields

import numpy as np
import pytest

from bench.__main__ import main
from bench.studies import bulk as bench
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


def test_the_command_prints_json_or_a_table(monkeypatch, capsys):
    no_mpmath(monkeypatch)
    monkeypatch.delenv("CI", raising=False)
    assert main(["bulk", "--falls", "5", "--rounds", "1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["falls"] == 5
    assert main(["bulk", "--falls", "5", "--rounds", "1"]) == 0
    table = capsys.readouterr().out
    assert table.startswith("25 rods, batches of 5 falls")
    assert "one fall over 25 square roots" in table
