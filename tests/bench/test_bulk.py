"""The bulk benchmark: every loop falls as the model does, and limits are measured.

How long anything takes is never tested.
"""

import json
import os

import numpy as np
import pytest

from bench.__main__ import main
from bench.studies import bulk as bench

needs_compiler = pytest.mark.skipif(
    bench.find_compiler() is None and not os.environ.get("CI"), reason="there is no C compiler here"
)


@needs_compiler
def test_all_loops_fall_as_the_model_does(tmp_path):
    batch = bench.draw_falls(300)
    methods = bench.methods(tmp_path)
    wanted = np.array(methods.pop("Python (rig)")(batch))
    for name, compute in methods.items():
        # A compiler may fuse a product and a sum into one rounding.
        rtol = 1e-5 if "32" in name else 2e-14
        np.testing.assert_allclose(compute(batch), wanted, rtol=rtol, atol=0.0, err_msg=name)


def test_the_command_measures_limits(monkeypatch, capsys):
    monkeypatch.delenv("CI", raising=False)
    assert main(["bulk", "--falls", "10", "--rounds", "1", "--json"]) == 0
    study = json.loads(capsys.readouterr().out)
    assert {point["value"] for point in study["points"]} == {1.0, 10.0}
    assert any("square roots" in limit for limit in study["limits"])
