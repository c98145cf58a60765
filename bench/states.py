"""All states that a drop can come to, further from its beginning than `./run test` has time for."""

from __future__ import annotations

import logging
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import pytest

from rig.bench.findings import Findings
from rig.commands.output import say
from rig.text_table import text_table
from tests.daemon import test_state_space

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator

_SPACE: Any = test_state_space  # tests have no types
_STEPS = {
    "undisturbed": _SPACE.ACTIONS,
    "disturbed at any moment": [*_SPACE.ACTIONS, *_SPACE.TROUBLES],
}


def run(arguments: Namespace) -> Iterator[Findings]:
    """Go through all states; it has failed when one of them ends badly."""
    logging.disable()  # what is told to users of all that goes wrong
    rows = [["", "steps", "ways", "states", "s"]]
    failed = False
    for (name, steps), depth in zip(_STEPS.items(), arguments.depths, strict=True):
        begun = time.monotonic()
        ways: list[object] = []
        with (
            TemporaryDirectory(prefix="rig-states-") as place,
            pytest.MonkeyPatch.context() as patch,
        ):
            try:
                states = _SPACE.explored(steps, depth, Path(place) / "rig", patch, told=ways.append)
            except AssertionError as error:
                say(str(error))
                failed = True
                break
        counts = depth, len(ways), len(states), round(time.monotonic() - begun)
        rows.append([name, *map(str, counts)])
    yield Findings({"states": rows}, text_table(rows, left={0}, rule=True), failed=failed)
