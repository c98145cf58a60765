"""The udev rule for known boards: ``python -m rig.usb.udev`` writes it."""

from __future__ import annotations

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
        f'SUBSYSTEM=="tty", {_match(kind)}, GROUP="dialout", MODE="0660", TAG+="uaccess"\n'
        for kind in KNOWN
    ]
    ignored = [f'{_match(kind)}, ENV{{ID_MM_DEVICE_IGNORE}}="1"\n' for kind in KNOWN if kind.board]
    return "".join([_HEAD, _OPEN, *opened, _MODEM, *ignored, '\nLABEL="chainrig_end"\n'])


def _match(kind: Known) -> str:
    return f'ATTRS{{idVendor}}=="{kind.vid:04x}", ATTRS{{idProduct}}=="{kind.pid:04x}"'


if __name__ == "__main__":
    print(rule(), end="")
