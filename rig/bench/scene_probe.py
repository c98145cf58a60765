"""What a scene costs, counted by a Python process that has done nothing else.

``python -c "from rig.bench.scene_probe import main; main()" FILE`` predicts the scene as the
command does, notes what that has loaded and taken, and only then loads what counting needs. Bytes
are counted where Python is started with ``-X tracemalloc``, which makes it slower.
"""

import sys
import time
from collections.abc import Callable

COUNTED = {
    "impact.impact_on": "impact coefficients",
    "impact.alpha_inclined": "g(θ)",
    "fall.fall": "falls",
    "drag.drag_fall": "falls in air",
    "<built-in method math.sqrt>": "square roots",
}
"""Functions whose calls are counted, by their files' and own names, and their names for people."""


def main() -> None:
    """Print what the scene of the command line costs, as JSON."""
    import io  # loaded by Python itself
    import runpy  # as by python -m

    path = sys.argv[1]
    stdout, sys.stdout = sys.stdout, io.StringIO()
    sys.argv = ["rig", "predict", path]
    try:
        runpy.run_module("rig", run_name="__main__", alter_sys=True)
    except SystemExit as stop:
        if stop.code:
            raise
    finally:
        sys.stdout = stdout
    seconds, modules = time.process_time(), sorted({*sys.modules} - {"rig.bench", __name__})

    import gc  # from here on nothing is counted as the scene's
    import json
    import tracemalloc

    gc.collect()
    held = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    from rig.predictions import predictions
    from rig.protocol.reader import read

    protocol = read(path)
    calls = count(lambda: predictions(protocol))
    print(json.dumps({"modules": modules, "bytes": held, "seconds": seconds, "calls": calls}))


def count(work: Callable[[], object]) -> dict[str, int]:
    """Count all calls of functions, and those of what `COUNTED` names; the same on every run."""
    from cProfile import Profile  # only to count
    from pathlib import Path

    work()  # once unseen: what only a first call does is no part of it
    profile = Profile()
    profile.runcall(work)
    calls = dict.fromkeys(("calls", *COUNTED.values()), 0)
    for code, count, *_ in profile.getstats():
        name = code if isinstance(code, str) else f"{Path(code.co_filename).stem}.{code.co_name}"
        for counter in {"calls", COUNTED.get(name, "calls")}:
            calls[counter] += count
    return calls
