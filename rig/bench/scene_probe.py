"""What a scene costs, counted by a Python process that has done nothing else.

``python -c "from rig.bench.scene_probe import main; main()" time FILE`` predicts the scene as the
command does and prints the processor time so far; with ``count`` it prints what that has loaded and
allocated, and only then loads what counting needs.
"""

from __future__ import annotations

import sys
import time

TYPE_CHECKING = False
if TYPE_CHECKING:
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
    """Print what is asked for on the command line, as JSON."""
    import io  # noqa: PLC0415 - loaded by Python itself
    import runpy  # noqa: PLC0415 - as by python -m

    task, path = sys.argv[1:]
    if task == "count":
        import tracemalloc  # noqa: PLC0415 - only to count

        tracemalloc.start()
    stdout, sys.stdout = sys.stdout, io.StringIO()
    sys.argv = ["rig", "predict", path]
    try:
        runpy.run_module("rig", run_name="__main__", alter_sys=True)
    except SystemExit as stop:
        if stop.code:
            raise
    finally:
        sys.stdout = stdout
    if task == "time":
        print(time.process_time())
        return
    import gc  # noqa: PLC0415 - only to count

    gc.collect()
    held = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    modules = sorted({*sys.modules} - {"rig.bench", __name__, "tracemalloc", "gc"})

    import json  # noqa: PLC0415 - from here on nothing is counted as the scene's

    from rig.predictions import predictions  # noqa: PLC0415
    from rig.protocol.reader import read  # noqa: PLC0415

    protocol = read(path)
    calls = count(lambda: predictions(protocol))
    print(json.dumps({"modules": modules, "bytes": held, "calls": calls}))


def count(work: Callable[[], object]) -> dict[str, int]:
    """Count all calls of functions, and those of what `COUNTED` names; the same on every run."""
    from cProfile import Profile  # noqa: PLC0415 - only to count
    from pathlib import Path  # noqa: PLC0415

    work()  # once unseen: what only a first call does is no part of it
    profile = Profile()
    profile.runcall(work)
    calls = dict.fromkeys(("calls", *COUNTED.values()), 0)
    for code, count, *_ in profile.getstats():
        name = code if isinstance(code, str) else f"{Path(code.co_filename).stem}.{code.co_name}"
        for counter in {"calls", COUNTED.get(name, "calls")}:
            calls[counter] += count
    return calls
