"""``rig service install``."""

from __future__ import annotations

import sys
from argparse import Namespace
from contextlib import suppress
from pathlib import Path

import platformdirs

from rig.commands.output import say
from rig.files import make_folder, write_atomic
from rig.ready import shipped
from rig.usb.listing import sole_port

_PORT = "RIG_PORT="


def main(arguments: Namespace) -> int:
    """Write the user's systemd unit that keeps a daemon running, and the board's port for it."""
    rig, config = arguments.name, platformdirs.user_config_path()
    port = _lasting(arguments.port or sole_port())
    unit = "chainrig@.service" if rig else "chainrig.service"
    settings = make_folder(config / "chainrig") / f"{rig or 'daemon'}.env"
    options: list[str] = []
    with suppress(FileNotFoundError):
        options = settings.read_text("utf-8").splitlines(keepends=True)
    options = [line for line in options if not line.startswith(_PORT)]
    write_atomic(settings, "".join([f"{_PORT}{port}\n", *options]))
    programs = str(Path(sys.executable).parent).replace("%", "%%")
    text = shipped(f"packaging/{unit}").read_text("utf-8").replace("%h/.local/bin", programs)
    write_atomic(make_folder(config / "systemd/user") / unit, text)
    service = f"chainrig@{rig}" if rig else "chainrig"
    say(f"{service}: {port}, by {settings}")
    say(f"start it: systemctl --user daemon-reload && systemctl --user enable --now {service}")
    return 0


def _lasting(port: str) -> str:
    """Return the name of a port that it has again after its board was plugged in elsewhere."""
    links = Path("/dev/serial/by-id").glob("*")
    return next((str(link) for link in links if link.resolve() == Path(port).resolve()), port)
