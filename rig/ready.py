"""Where ready files are: in the installed package, or in the project it runs from."""

import os
from pathlib import Path

from rig.errors import InputError


def ready_protocols() -> dict[str, Path]:
    """Return the ready protocols by their names, which have no ending."""
    return {path.stem: path for path in sorted(find_resource("protocols").glob("*.yaml"))}


def ready_protocol(name: str) -> Path:
    """Return the file of a ready protocol.

    Raises
    ------
    InputError
        There is none of that name.
    """
    ready = ready_protocols()
    if name not in ready:
        raise InputError(f"{name} is no ready protocol", f"accepted: {', '.join(ready)}")
    return ready[name]


def find_protocol(name: str) -> str:
    """Return the file that a name means: one in this folder, or else a ready protocol.

    Parameters
    ----------
    name
        A file's, with or without ``.yaml``, or a ready protocol's; any other is returned as it is.
    """
    places = (name, f"{name}.yaml", str(ready_protocols().get(name, "")))
    return next(filter(os.path.isfile, places), name)


def find_resource(name: str) -> Path:
    """Find a file or a folder that comes with this program.

    Raises
    ------
    InputError
        Where this installation lacks it.
    """
    for folder in Path(__file__).parents[:2]:
        if (path := folder / name).exists():
            return path
    raise InputError(f"this installation has no {name}", "install chainrig again")
