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
_PART = "./experiment/"
_KINDS = {
    "csv": "text/csv",
    "html": "text/html",
    "json": "application/json",
    "session": "application/vnd.sqlite3",
    "svg": "image/svg+xml",
    "txt": "text/plain",
    "yaml": "application/yaml",
}
"""Media types by ending: the system's own list differs between systems."""


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
    about = "Simulated drops: nothing fell." if simulated else "Drops past photogates."
    created = meta["created"]
    licence = (
        "Whoever publishes the measurement chooses its licence; this bundle grants none. The "
        "program that made it has the MIT licence."
    )
    described = [
        {
            "@id": f"./{name}",
            "@type": "File",
            "name": name.rpartition("/")[2],
            "encodingFormat": _KINDS.get(name.rpartition(".")[2], "application/octet-stream"),
            "contentSize": str(len(content)),
            "sha256": sha256(content),
        }
        for name, content in sorted(files.items())
    ]
    graph: list[dict[str, Any]] = [
        {
            "@id": CRATE,
            "@type": "CreativeWork",
            "about": {"@id": "./"},
            "conformsTo": {"@id": "https://w3id.org/ro/crate/1.1"},
            "sdPublisher": {"@id": "#chainrig"},
        },
        {
            "@id": "./",
            "@type": "Dataset",
            "name": title or "A session",
            "description": about,
            "datePublished": created,
            "license": {"@id": "#licence"},
            "hasPart": [{"@id": _PART}],
        },
        {
            "@id": _PART,
            "@type": "Dataset",
            "name": title or "A session",
            "description": about,
            "dateCreated": created,
            "citation": [{"@id": "#paper"}],
            "hasPart": [{"@id": row["@id"]} for row in described],
        },
        *described,
        {
            "@id": "#made",
            "@type": "CreateAction",
            "name": "rig export --bundle",
            "instrument": {"@id": "#chainrig"},
            "object": {"@id": "./experiment/record.session"},
            "result": {"@id": _PART},
        },
        {
            "@id": "#chainrig",
            "@type": "SoftwareApplication",
            "name": "chainrig",
            "version": __version__,
            "license": "https://spdx.org/licenses/MIT",
            "citation": SOFTWARE,
        },
        {"@id": "#licence", "@type": "CreativeWork", "name": "No licence", "description": licence},
        {"@id": "#paper", "@type": "ScholarlyArticle", "name": PAPER},
    ]
    return {"@context": "https://w3id.org/ro/crate/1.1/context", "@graph": graph}
