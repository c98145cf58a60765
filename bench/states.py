"""All states that a drop can come to, further from its beginning than `./run test` has time for."""

from __future__ import annotations

import json
import logging
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import pytest

from rig.commands.output import say
from rig.text_table import text_table
from tests.daemon import test_state_space

if TYPE_CHECKING:
    from argparse import Namespace

_SPACE: Any = test_state_space  # tests have no types
_STEPS = {
    "undisturbed": _SPACE.ACTIONS,
    "disturbed at any moment": [*_SPACE.ACTIONS, *_SPACE.TROUBLES],
}


def main(arguments: Namespace) -> int:
    """Go through all states and print how many there are; 1 when one of them ends badly."""
    logging.disable()  # what is told to users of all that goes wrong
    rows = [["", "steps", "ways", "states", "s"]]
    for name, depth in zip(_STEPS, arguments.depths, strict=True):
        begun = time.monotonic()
        ways: list[object] = []
        with (
            TemporaryDirectory(prefix="rig-states-") as place,
            pytest.MonkeyPatch.context() as patch,
        ):
            try:
                found = _SPACE.explored(
                    _STEPS[name], depth, Path(place) / "rig", patch, told=ways.append
                )
            except AssertionError as error:
                say(str(error))
                return 1
        told = depth, len(ways), len(found), round(time.monotonic() - begun)
        rows.append([name, *map(str, told)])
    print(json.dumps(rows) if arguments.json else "\n".join(text_table(rows, left={0}, rule=True)))
    return 0
