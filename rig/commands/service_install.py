"""``rig service install``."""

import sys
from pathlib import Path

import platformdirs

from rig.commands.output import Arguments, say
from rig.files import make_folder, write_atomic
from rig.ready import find_resource
from rig.usb.listing import sole_port


def main(arguments: Arguments) -> None:
    """Write the user's systemd unit that keeps a daemon running at the board's port."""
    rig, port = arguments.name, _lasting_name(arguments.port or sole_port())
    template = "chainrig@.service" if rig else "chainrig.service"
    text = find_resource(f"packaging/{template}").read_text("utf-8")
    values = {
        "%h/.local/bin": str(Path(sys.executable).parent).replace("%", "%%"),
        "${RIG_PORT}": port.replace("%", "%%"),
        "EnvironmentFile=": "EnvironmentFile=-",  # there may be RIG_OPTIONS in it
    }
    for placeholder, value in values.items():
        text = text.replace(placeholder, value)
    service = f"chainrig@{rig}" if rig else "chainrig"
    folder = make_folder(platformdirs.user_config_path() / "systemd/user")
    write_atomic(folder / f"{service}.service", text)
    say(f"{folder / service}.service: {port}")
    if "://" not in port and not Path(port).exists():
        say(f"nothing is at {port} now: plug the board in, or name another port; see rig ports")
    say(f"start it: systemctl --user daemon-reload && systemctl --user enable --now {service}")


def _lasting_name(port: str) -> str:
    """Return the name of a port that it has again after its board was plugged in elsewhere."""
    links = Path("/dev/serial/by-id").glob("*")
    return next((str(link) for link in links if link.resolve() == Path(port).resolve()), port)
