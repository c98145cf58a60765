"""The resolved world by itself: error against run time, others' chains, one fall drawn."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from subprocess import PIPE, run
from typing import Any

from rig.bench.falls import Asked, falls, with_setting
from rig.errors import RigError
from rig.films import Film
from rig.protocol import reader
from rig.protocol.plan import runs as planned

UNIFORM = "inclined-uniform.yaml"


def work() -> list[dict[str, Any]]:
    """Measure error against run time of the resolved world's step and touches.

    Raises
    ------
    RigError
        The simulation gave up.
    """
    return _lines("bench.studies.resolved_precision")


def published() -> list[dict[str, Any]]:
    """Let the chains of other experiments fall, see `bench.studies.published_falls`.

    Raises
    ------
    RigError
        The simulation gave up.
    """
    return _lines("bench.studies.published_falls")


def _lines(module: str) -> list[dict[str, Any]]:
    done = run([sys.executable, "-m", module], stdout=PIPE, text=True, check=False)
    if done.returncode:
        raise RigError(f"the simulation ended with exit code {done.returncode}")
    return [json.loads(line) for line in done.stdout.splitlines()]


def film(folder: str, incline_deg: float) -> Film:
    """Let the uniform chain fall onto a board once, to be drawn.

    Raises
    ------
    RigError
        The simulation gave up.
    """
    path = Path(folder) / UNIFORM
    number = next(
        one.number for one in planned(reader.read(path)) if one.incline_deg == incline_deg
    )
    url = with_setting("sim://?dynamics=resolved&film=1", "protocol", str(path.resolve()))
    (made,) = falls([Asked(url, [1], [[number]])])
    return Film(**made.truth["film"])
