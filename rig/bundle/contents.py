"""What a bundle holds: everything follows from the session file in it.

`session_copy` gives that file, `bundle_files` all others. To verify a bundle is to call them again.
"""

from __future__ import annotations

import json
import platform
import sqlite3
from contextlib import closing
from importlib.metadata import version
from typing import TYPE_CHECKING

import numpy as np

from rig import __version__
from rig.bundle.archive import SUMS
from rig.bundle.crate import CRATE, crate
from rig.bundle.digests import hash_rows, sha256
from rig.bundle.history import describe_history
from rig.bundle.tables import data_package, mean_tables
from rig.results import protocol_of, tick_rates
from rig.session.export import csv_files

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rig.results import SessionResults
    from rig.session.reading import Reader

FOLDER = "experiment/"
SESSION = f"{FOLDER}record.session"
RESULTS = f"{FOLDER}results.json"
ENVIRONMENT = f"{FOLDER}environment.json"
ROWS = f"{FOLDER}rows.json"
PAGE = f"{FOLDER}report.html"
HISTORY = f"{FOLDER}deviations.txt"


def session_copy(session: Reader) -> bytes:
    """Return a session's content as a file of its own; the same rows give the same bytes.

    What a log (``-wal``) beside the file adds is in it. The session stays as it is.
    """
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as memory:
        session.connection.backup(memory)
        memory.execute("VACUUM")  # how often and by whom pages were written is gone
        return memory.serialize()


def bundle_files(
    session: Reader,
    data: bytes,
    results: SessionResults,
    drawn: Mapping[str, bytes],
    extra: Mapping[str, bytes],
) -> dict[str, bytes]:
    """Make all files of a bundle.

    Parameters
    ----------
    session, data
        The session file of the bundle, open, and its bytes.
    results
        Of it.
    drawn
        The report and the figures, by name.
    extra
        Files that do not follow from the session, by name below the archive's root.

    Returns
    -------
    dict
        Contents by name below the archive's root, ``SHA256SUMS`` included.
    """
    protocol = protocol_of(session)
    texts = csv_files(session, results.json(), tick_rates(session))
    readme = texts.pop("README.txt")
    texts |= mean_tables(protocol, results.analysis)
    texts = {f"{FOLDER}tables/{name}": text for name, text in texts.items()}
    texts |= {
        f"{FOLDER}tables/datapackage.json": data_package(texts),
        f"{FOLDER}README.txt": readme,
        f"{FOLDER}protocol.yaml": session.protocol_text,
        HISTORY: "\n".join([*describe_history(session, protocol, results.analysis), ""]),
        RESULTS: _json(results.json()),
        ENVIRONMENT: _json(environment()),
        ROWS: _json(hash_rows(data)),
    }
    files = {name: text.encode() for name, text in texts.items()} | {**extra}
    files |= {f"{FOLDER}{name}": content for name, content in drawn.items()}
    files[SESSION] = data
    files[CRATE] = _json(crate(protocol.title, session.meta, files)).encode()
    sums = [f"{sha256(files[name])}  {name}\n" for name in sorted(files)]
    return files | {SUMS: "".join(sums).encode()}


def environment() -> dict[str, str]:
    """Return the versions that numbers depend on."""
    return {
        "rig": __version__,
        "numpy": np.__version__,
        "scipy": version("scipy"),
        "matplotlib": version("matplotlib"),
        "python": platform.python_version(),
        "sqlite": sqlite3.sqlite_version,
        "system": platform.system(),
        "machine": platform.machine(),
    }


def _json(value: object) -> str:
    return json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
