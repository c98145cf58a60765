"""What one scene costs, told by a Python process that has done nothing else.

``python -c "from rig.bench.scene_probe import main; main()" FILE`` predicts the scene as the
command does, looks at what that has loaded, and only then loads what counting needs.
"""

from __future__ import annotations

import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType
    from typing import Any

_OWN = {"rig.bench", "rig.bench.scene_probe"}


def main() -> None:
    """Print the account of the file named on the command line as one line of JSON."""
    print(account(sys.argv[1]))


def account(path: str) -> str:
    """Predict a protocol file; meant for a fresh process.

    Returns
    -------
    str
        JSON: ``modules``, all names loaded; ``peak_bytes``; ``operations``, bytecodes of reading,
        describing and predicting; ``evaluations``, how often the prediction does what.
    """
    import io  # noqa: PLC0415 - loaded by Python itself
    import runpy  # noqa: PLC0415 - as by python -m

    stdout, sys.stdout = sys.stdout, io.StringIO()
    sys.argv = ["rig", "predict", path]
    try:
        runpy.run_module("rig", run_name="__main__", alter_sys=True)
    except SystemExit as stop:
        if stop.code:
            raise
    finally:
        sys.stdout = stdout
    modules = sorted(set(sys.modules) - _OWN)
    peak = peak_bytes()

    import json  # noqa: PLC0415 - from here on nothing is counted as the scene's

    from rig.predictions import predictions  # noqa: PLC0415
    from rig.protocol.describe import describe  # noqa: PLC0415
    from rig.protocol.reader import read  # noqa: PLC0415

    protocol = read(path)
    describe(protocol)  # once unseen: what only a first call does is no part of the work
    return json.dumps(
        {
            "modules": modules,
            "peak_bytes": peak,
            "operations": {
                "read": bytecodes(lambda: read(path)),
                "describe": bytecodes(lambda: describe(protocol)),
                "predict": bytecodes(lambda: predictions(protocol)),
            },
            "evaluations": evaluations(lambda: predictions(protocol)),
        }
    )


def peak_bytes() -> int:
    """Return the most memory that this process has had resident, bytes."""
    try:
        # Not getrusage where it can be helped: Linux starts that with the parent's own peak.
        with open("/proc/self/status", encoding="ascii") as status:  # noqa: PTH123 - no pathlib yet
            return next(int(line.split()[1]) * 1024 for line in status if line.startswith("VmHWM"))
    except (OSError, StopIteration):
        import resource  # noqa: PLC0415

        unit = 1 if sys.platform == "darwin" else 1024
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


def bytecodes(work: Callable[[], object]) -> int:
    """Count the bytecode instructions that Python executes; the same on every run."""
    count = 0

    def trace(frame: FrameType, event: str, _: Any) -> Any:
        nonlocal count
        frame.f_trace_opcodes = True
        count += event == "opcode"
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        work()
    finally:
        sys.settrace(before)
    return count


COUNTED = {
    "rig.model.impact.impact_on": "impact coefficients",
    "rig.model.impact.alpha_inclined": "g(θ)",
    "rig.model.fall.fall": "falls",
    "rig.model.drag.drag_fall": "falls",
    "rig.model.fall.hits": "trajectories",
    "rig.model.drag.drag_hits": "trajectories",
    "rig.model.motion.Motion.__init__": "trajectories",
    "math.sqrt": "square roots",
}


def evaluations(work: Callable[[], object]) -> dict[str, int]:
    """Count how often the work calls what `COUNTED` names."""
    counts = dict.fromkeys(COUNTED.values(), 0)

    def profile(frame: FrameType, event: str, called: Any) -> None:
        if event == "call":
            name = f"{frame.f_globals.get('__name__')}.{frame.f_code.co_qualname}"
        elif event == "c_call":
            name = f"{called.__module__}.{called.__qualname__}"
        else:
            return
        if name in COUNTED:
            counts[COUNTED[name]] += 1

    before = sys.getprofile()
    sys.setprofile(profile)
    try:
        work()
    finally:
        sys.setprofile(before)
    return counts
