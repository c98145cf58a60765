"""Checks of a port: is it there, may it be used, who else does."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.doctor.findings import Finding

if TYPE_CHECKING:
    from rig.doctor.facts import PortFacts

RULE = (
    "python -m rig.usb.udev | sudo tee /etc/udev/rules.d/60-chainrig.rules, then "
    "sudo udevadm control --reload and sudo udevadm trigger"
)


def permission(port: PortFacts) -> Finding:
    """See that this user may read and write the port."""
    name = f"permission for {port.path}"
    if not port.exists:
        return Finding(name, "there is no such port", "is the board plugged in? rig ports")
    if port.usable:
        return Finding(name, "given")
    group = port.group or "its group"
    return Finding(
        name,
        f"not given: it belongs to the group {group}",
        f"sudo usermod -aG {port.group or 'dialout'} $USER and log in again, or {RULE}",
    )


def other_owners(port: PortFacts) -> Finding:
    """See that no other process has the port open."""
    name = f"other users of {port.path}"
    if not port.owners:
        return Finding(name, "none seen")
    said = ", ".join(f"{owner.command} (process {owner.pid})" for owner in port.owners)
    daemon = any("daemon" in owner.command for owner in port.owners)
    advice = "let that daemon do the work: rig run and rig tui ask it" if daemon else ""
    return Finding(name, said, advice or "close that program")


def modem_manager(port: PortFacts) -> Finding:
    """See that ModemManager does not take the board for a modem."""
    name = f"ModemManager and {port.path}"
    if not port.modem_manager:
        return Finding(name, "it does not run")
    if port.left_alone:
        return Finding(name, "it is told to leave this port alone")
    return Finding(name, "it may speak to the board, which restarts it", RULE)
