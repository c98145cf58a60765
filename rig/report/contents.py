"""What a page carries of a session's raw data, as far as it stays small enough to be sent."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.bundle.tables import csv_files
from rig.report.attachments import Attachment, zipped
from rig.report.method import METHOD, method_page
from rig.report.timeline import Timeline, timeline
from rig.results import tick_rates

if TYPE_CHECKING:
    from rig.protocol.protocol import Protocol
    from rig.results import SessionResults
    from rig.session.reading import Reader

_TIMELINES = 500_000
_DATA = 500_000
"""Bytes at most, so that a page stays under 2 MB with its figures."""


def timelines_and_data(
    session: Reader, protocol: Protocol, found: SessionResults
) -> tuple[list[Timeline], list[Attachment]]:
    """Draw the drops of a session, those first that do not count, and pack its tables.

    Returns
    -------
    timelines, attachments
        Timelines by run and attempt. Without edges where those are too many; without numbers that a
        blind session keeps back.
    """
    return _timelines(session, protocol, found), _data(session, found)


def _timelines(session: Reader, protocol: Protocol, found: SessionResults) -> list[Timeline]:
    if protocol.gates is None:
        return []
    results = {
        (one.run.number, one.attempt): one
        for one in (*found.analysis.runs, *found.analysis.superseded)
    }
    drops = {(drop.run, drop.attempt): drop for drop in session.drops()}
    drawn: dict[tuple[int, int], Timeline] = {}
    left = _TIMELINES
    for key in sorted(results, key=lambda key: (results[key].verdict == "accepted", key)):
        drop = drops[key]
        hz = found.clock.scale(drop).hz
        svg = timeline(protocol.gates.gates, drop, hz, results[key])
        left -= len(svg)
        if svg and left > 0:
            drawn[key] = Timeline(results[key], svg)
    return [drawn[key] for key in sorted(drawn)]


def _data(session: Reader, found: SessionResults) -> list[Attachment]:
    files = csv_files(session, found.json(), tick_rates(session))
    protocol = {"protocol.yaml": session.protocol_text}
    words = "results, budgets and edges as CSV files, with the protocol"
    packed = zipped({**files, **protocol})
    if len(packed) > _DATA:
        words = "results and budgets as CSV files, with the protocol; rig export also writes edges"
        packed = zipped({**{n: t for n, t in files.items() if n != "edges.csv"}, **protocol})
    attached = [
        Attachment(file.name, "application/octet-stream", file.data, f"attached {file.added}")
        for file in session.attached_files()
        if len(file.data) <= _DATA
    ]
    return [
        Attachment("data.zip", "application/zip", packed, words),
        Attachment("summary.csv", "text/csv", files["summary.csv"].encode(), "means only"),
        Attachment(METHOD, "text/markdown", method_page().encode(), "the whole method"),
        *attached,
    ]
