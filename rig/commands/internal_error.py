"""Internal errors, which nobody foresaw: a short message, and a log to report it with."""

import os
import platform
import shlex
import sys
import traceback
from datetime import UTC, datetime

from rig import __version__
from rig.errors import RigError
from rig.files import make_folder, state_folder, write_atomic
from rig.printable import printable
from rig.streams import say


def report(error: BaseException) -> int:
    """Write a log of an internal error into the state folder, say where it is.

    Returns
    -------
    int
        The exit code.
    """
    moment = datetime.now(UTC)
    packages = {name for name in sys.modules if "." not in name} - sys.stdlib_module_names
    versions = {name: vars(sys.modules[name]).get("__version__") for name in sorted(packages)}
    lines = [
        f"{moment.isoformat(timespec='seconds')}, process {os.getpid()}",
        f"command: {shlex.join(sys.argv)}",
        f"rig {__version__}, Python {sys.version}, {platform.platform()}",
        *(f"{name} {version}" for name, version in versions.items() if version and name != "rig"),
        "",
        "".join(traceback.format_exception(error)),
    ]
    try:
        folder = make_folder(state_folder())
        log = folder / f"internal-error-{moment:%Y%m%dT%H%M%SZ}-{os.getpid()}.log"
        write_atomic(log, printable("\n".join(lines)))
        where = f"with the log at {log}"
    except RigError as failure:
        where = f"with this line, for its log could not be written: {failure.message}"
    say(f"rig: internal error ({type(error).__name__}); this is a bug, please report it {where}")
    return RigError.exit_code
