"""``rig completion``."""

from argparse import Namespace

from argcomplete.shell_integration import shellcode


def main(arguments: Namespace) -> None:
    """Print what a shell reads to complete commands, options, choices and files."""
    print(shellcode(["rig"], shell=arguments.shell))
