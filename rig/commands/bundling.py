"""Making the files of a bundle, for ``rig export --bundle`` and for ``rig verify``."""

from __future__ import annotations

from argparse import Namespace
from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from rig.bundle.archive import SUMS, pack
from rig.bundle.contents import PAGE, SESSION, bundle_files, session_copy
from rig.bundle.signing import PUBLIC_KEY, SIGNATURE, public_key, sign
from rig.commands import report
from rig.commands.output import progress, say, tell_damage
from rig.files import check_place, replacing
from rig.results import SessionResults, results
from rig.session.store import Session

if TYPE_CHECKING:
    from collections.abc import Mapping


def write_bundle(arguments: Namespace) -> int:
    """Write a session as a bundle; the same session gives the same bytes."""
    check_place(arguments.bundle)
    key = arguments.sign
    extra = {} if key is None else {PUBLIC_KEY: public_key(key)}
    with Session.open(arguments.session, readonly=True) as session:
        data = session_copy(session)
    files, found = make_files(data, extra)
    if key is not None:
        files[SIGNATURE] = sign(files[SUMS], key)
    with replacing(arguments.bundle) as stream:
        stream.write(pack(files))
    say(f"bundle: {arguments.bundle}; rig verify {arguments.bundle} checks it")
    return tell_damage(found.analysis)


def make_files(data: bytes, extra: Mapping[str, bytes]) -> tuple[dict[str, bytes], SessionResults]:
    """Derive all files of a bundle from its session file.

    Parameters
    ----------
    data
        The session file.
    extra
        Files that do not follow from it: the key.

    Raises
    ------
    SessionError
        It cannot be read.
    """
    with TemporaryDirectory(prefix="rig-bundle-") as folder:
        place = Path(folder)
        copy = place / Path(SESSION).name
        copy.write_bytes(data)
        page, figures = place / Path(PAGE).name, place / "figures"
        with redirect_stderr(StringIO()):  # of files that nobody will see
            # Every number from the raw edges: what is kept of earlier results proves nothing.
            drawing = Namespace(session=copy, output=page, figures=figures, bars="U95", fresh=True)
            report.main(drawing)
        drawn = {
            path.relative_to(place).as_posix(): path.read_bytes()
            for path in [page, *sorted(figures.iterdir())]
        }
        with Session.open(copy, readonly=True) as session:
            found = results(session, progress("analysing run"))
            return bundle_files(session, data, found, drawn, extra), found
