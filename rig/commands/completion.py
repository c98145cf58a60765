"""``rig completion``."""

from argcomplete.shell_integration import shellcode

from rig.commands.output import Arguments


def main(arguments: Arguments) -> None:
    """Print what a shell reads to complete commands, options, choices and files."""
    print(shellcode(["rig"], shell=arguments.shell))
