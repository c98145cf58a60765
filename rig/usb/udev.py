"""The udev rule for known boards: ``python -m rig.usb.udev`` writes it."""

from __future__ import annotations

from collections.abc import Iterable

from rig.usb.listing import KNOWN, Known

_HEAD = """\
# Boards of a chain rig. Put this into /etc/udev/rules.d/, then
#     udevadm control --reload && udevadm trigger
# Written by python -m rig.usb.udev.

ACTION=="remove", GOTO="chainrig_end"
"""
_OPEN = """
# Whoever sits at this computer, and the group dialout, may open the port. The chips are also on
# copies of boards.
"""
_MODEM = """
# A board is no modem: ModemManager must not open its port, which would restart it. The chips are
# left to it, since modems have them too.
"""


def rule() -> str:
    """Write the rule's file."""
    opened = [
        f'SUBSYSTEM=="tty", {match}, GROUP="dialout", MODE="0660", TAG+="uaccess"\n'
        for match in _matches(KNOWN)
    ]
    boards = [kind for kind in KNOWN if kind.board]
    ignored = [f'{match}, ENV{{ID_MM_DEVICE_IGNORE}}="1"\n' for match in _matches(boards)]
    return "".join([_HEAD, _OPEN, *opened, _MODEM, *ignored, '\nLABEL="chainrig_end"\n'])


def _matches(kinds: Iterable[Known]) -> list[str]:
    """Write what matches the numbers of some kinds, each once."""
    numbers = dict.fromkeys(pair for kind in kinds for pair in kind.numbers.split())
    match = 'ATTRS{{idVendor}}=="{}", ATTRS{{idProduct}}=="{}"'
    return [match.format(*pair.split(":")) for pair in numbers]


if __name__ == "__main__":
    print(rule(), end="")
