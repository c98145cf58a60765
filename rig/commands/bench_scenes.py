"""``rig bench scenes``."""

from argparse import Namespace

from rig.bench import scenes
from rig.commands.study import carry_out


def main(arguments: Namespace) -> int:
    """Carry the study out; keep and print what it finds."""
    return carry_out("scenes", scenes.run, arguments)
