"""The RO-Crate metadata file, with the profile of the ELN consortium (``.eln``).

It is one JSON-LD file of fixed form, so it needs no library: https://w3id.org/ro/crate/1.1.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rig import __version__
from rig.bundle.digests import sha256
from rig.report.method import PAPER, SOFTWARE

if TYPE_CHECKING:
    from collections.abc import Mapping

CRATE = "ro-crate-metadata.json"
PART = "experiment/"
"""The folder of all files but those on the bundle itself."""
_STANDARD = "https://w3id.org/ro/crate/1.1"
_KINDS = {
    "csv": "text/csv",
    "html": "text/html",
    "jpg": "image/jpeg",
    "json": "application/json",
    "pdf": "application/pdf",
    "png": "image/png",
    "session": "application/vnd.sqlite3",
    "svg": "image/svg+xml",
    "txt": "text/plain",
    "yaml": "application/yaml",
}
"""Media types by ending: the system's own list differs between systems."""
_LICENCE = (
    "Whoever publishes the measurement chooses its licence; this bundle grants none. The program "
    "that made it has the MIT licence. Letters in figures are outlines of DejaVu Sans (licence of "
    "Bitstream Vera)."
)


def crate(title: str, meta: Mapping[str, str], files: Mapping[str, bytes]) -> dict[str, Any]:
    """Describe the files of a bundle.

    Parameters
    ----------
    title
        Of the protocol.
    meta
        Facts of the session. Its date is the only one: the same session gives the same crate.
    files
        Contents by name below the crate's root.
    """
    simulated = meta["simulated"] == "true"
    text = "Simulated drops: nothing fell." if simulated else "Drops past photogates."
    about: dict[str, Any] = {
        "name": title or "A session",
        "description": text,
        "datePublished": meta["created"],
    }
    about |= {"license": _to("#licence"), "citation": _to("#paper")}
    tool = {"name": "chainrig", "version": __version__, "citation": SOFTWARE}
    head = {"about": _to("./"), "conformsTo": _to(_STANDARD), "sdPublisher": _to("#chainrig")}
    described = [_file(name, content) for name, content in sorted(files.items())]
    graph = [
        _entity(CRATE, "CreativeWork", **head),
        _entity("./", "Dataset", **about, hasPart=[_to(f"./{PART}")]),
        _entity(f"./{PART}", "Dataset", **about, hasPart=[_to(row["@id"]) for row in described]),
        *described,
        _entity("#chainrig", "SoftwareApplication", **tool),
        _entity("#licence", "CreativeWork", name="Licences", description=_LICENCE),
        _entity("#paper", "ScholarlyArticle", name=PAPER),
    ]
    return {"@context": f"{_STANDARD}/context", "@graph": graph}


def _file(name: str, content: bytes) -> dict[str, Any]:
    return _entity(
        f"./{name}",
        "File",
        name=name.rpartition("/")[2],
        encodingFormat=_KINDS.get(name.rpartition(".")[2], "application/octet-stream"),
        contentSize=str(len(content)),
        sha256=sha256(content),
    )


def _entity(identifier: str, kind: str, **members: Any) -> dict[str, Any]:
    return {"@id": identifier, "@type": kind, **members}


def _to(identifier: str) -> dict[str, str]:
    return {"@id": identifier}
