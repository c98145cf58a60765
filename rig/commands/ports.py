"""``rig ports``."""

from __future__ import annotations

from argparse import Namespace
from collections import Counter
from collections.abc import Mapping
from contextlib import closing
from dataclasses import asdict
from typing import Any

from rig.commands.output import print_json, say
from rig.errors import DeviceError
from rig.flash.drive import sees_boot_pico, waiting_drives
from rig.link.client import Device
from rig.link.port import open_port, port_clock
from rig.reasons import make_reason
from rig.usb.listing import SerialPort, serial_ports


def main(arguments: Namespace) -> int:
    """List the ports, and ask who is there where that is wanted."""
    ports = serial_ports()
    listed = {port.path for port in ports}
    asked: dict[str, dict[str, Any]] = {}
    if arguments.identify is not None:
        chosen = arguments.identify or [port.path for port in ports if port.candidate]
        asked = {path: _identify(path) for path in chosen}
    why = "not a serial port of this computer"
    ports += [SerialPort(path, skipped=why) for path in asked if path not in listed]
    if arguments.json:
        print_json({"ports": [_fields(port, asked) for port in ports]})
        return 0
    for port in ports:
        print(_line(port, asked.get(port.path)))
    identities = (answer["identity"] for answer in asked.values() if answer["identity"])
    ids = Counter(identity["unique_id"] for identity in identities)
    for shared in (number for number, count in ids.items() if count > 1):
        say(f"several boards have the id {shared}: erase the EEPROM of all but one board")
    for drive in waiting_drives():
        say(f"a Pico waits for firmware at {drive}: rig flash --board pico")
    if sees_boot_pico() and not waiting_drives():
        say(f"{make_reason('pico_unmounted').text}: rig flash --board pico")
    if not any(port.candidate for port in ports):
        say("no board found: check its plug, and use a USB cable with data wires")
    return 0


def _identify(path: str) -> dict[str, Any]:
    """Ask who is at a port; what is wrong there is an answer too."""
    try:
        with closing(open_port(path)) as port:
            identity = Device(port, port_clock(port), tries=3).connect()
    except DeviceError as error:
        return {"identity": None, "trouble": str(error)}
    return {"identity": identity.json(), "trouble": None}


def _fields(port: SerialPort, asked: Mapping[str, dict[str, Any]]) -> dict[str, Any]:
    fields = {"kind": port.kind, "candidate": port.candidate, "identity": None, "trouble": None}
    return asdict(port) | fields | asked.get(port.path, {})


def _line(port: SerialPort, answer: Mapping[str, Any] | None) -> str:
    parts = [port.path]
    if port.vid is not None and port.pid is not None:
        parts.append(f"USB {port.vid:04x}:{port.pid:04x}")
    if port.serial_number:
        parts.append(f"serial number {port.serial_number}")
    parts += filter(None, dict.fromkeys([port.product, port.kind]))
    if answer is None:
        parts.append(f"skipped: {port.skipped}" if port.skipped else "a candidate")
    elif answer["identity"] is None:
        parts.append(answer["trouble"].replace("\n", ";"))
    else:
        identity = answer["identity"]
        parts.append(f"{identity['board']}, {identity['firmware']}, id {identity['unique_id']}")
    return "  ".join(parts)
