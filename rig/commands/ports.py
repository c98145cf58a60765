"""``rig ports``."""

from collections import Counter
from contextlib import closing
from typing import Any

from rig.commands.output import Arguments, print_data, say
from rig.errors import DeviceError
from rig.flash.drive import sees_boot_pico, waiting_drives
from rig.link.client import Device
from rig.link.port import open_port, port_clock
from rig.reasons import make_reason
from rig.report.templates import sentence
from rig.usb.listing import SerialPort, serial_ports


def main(arguments: Arguments) -> None:
    """List the ports, and ask who is there where that is wanted."""
    ports = serial_ports()
    chosen = arguments.identify
    if chosen == []:
        chosen = [port.path for port in ports if port.candidate]
    listed = {port.path for port in ports}
    ports += [
        SerialPort(path, skipped="not a serial port of this computer")
        for path in chosen or ()
        if path not in listed
    ]
    records = [_describe(port, ask=port.path in (chosen or ())) for port in ports]
    lines = (sentence("port", record) for record in records)
    print_data({"ports": records}, lines, as_json=arguments.json)
    if arguments.json:
        return
    ids = Counter(record["identity"]["unique_id"] for record in records if record["identity"])
    for shared in (number for number, count in ids.items() if count > 1):
        say(f"several boards have the id {shared}: erase the EEPROM of all but one board")
    for drive in waiting_drives():
        say(f"a Pico waits for firmware at {drive}: rig flash --board pico")
    if sees_boot_pico() and not waiting_drives():
        say(f"{make_reason('pico_unmounted').text}: rig flash --board pico")
    if not any(port.candidate for port in ports):
        say("no board found: check its plug, and use a USB cable with data wires")


def _describe(port: SerialPort, *, ask: bool) -> dict[str, Any]:
    """Say what a port is and, where asked, who is there; what is wrong there is an answer too."""
    record = port._asdict() | {"kind": port.kind, "candidate": port.candidate}
    identity, trouble = None, None
    if ask:
        try:
            with closing(open_port(port.path)) as opened:
                identity = Device(opened, port_clock(opened), tries=3).connect().json()
        except DeviceError as error:
            trouble = str(error)
    return record | {"identity": identity, "trouble": trouble}
