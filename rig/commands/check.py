"""``rig check``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.predictions import notes
from rig.protocol import reader
from rig.protocol.describe import describe

if TYPE_CHECKING:
    from argparse import Namespace


def main(arguments: Namespace) -> int:
    """Describe a protocol."""
    protocol = reader.read(arguments.protocol)
    print(describe(protocol, notes(protocol)))
    return 0
