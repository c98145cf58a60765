"""``rig check``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.boards import BOARDS
from rig.predictions import notes
from rig.protocol import reader
from rig.protocol.describe import describe
from rig.protocol.measurable import check_recordable, unmeasurable

if TYPE_CHECKING:
    from argparse import Namespace

    from rig.protocol.protocol import Protocol


def main(arguments: Namespace) -> int:
    """Describe a protocol."""
    protocol = reader.read(arguments.protocol)
    if arguments.board:
        check_recordable(protocol, BOARDS[arguments.board])
    print(describe(protocol, [*notes(protocol), *_trials(protocol)]))
    return 0


def _trials(protocol: Protocol) -> list[str]:
    """Say how many drops the protocol's gates will let be read, where it can be measured."""
    if protocol.gates is None or not protocol.gates.gates or unmeasurable(protocol):
        return []
    from rig.design.trials import trials, trials_text  # noqa: PLC0415 - numpy, only with gates

    return [trials_text(trials(protocol))]
