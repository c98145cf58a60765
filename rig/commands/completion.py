"""``rig completion``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from argcomplete.shell_integration import shellcode

if TYPE_CHECKING:
    from argparse import Namespace


def main(arguments: Namespace) -> int:
    """Print what a shell reads to complete commands, options, choices and files."""
    print(shellcode(["rig"], shell=arguments.shell))
    return 0
