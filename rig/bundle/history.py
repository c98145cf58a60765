"""What was stated before the first run, and where the session departed from it later."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.report.deviations import deviations

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rig.analysis.session import Analysis
    from rig.protocol.protocol import Protocol
    from rig.session.reading import Reader

_FIXED = {True: "yes", False: "no", None: "unknown; an older program recorded them"}


def describe_history(session: Reader, protocol: Protocol, analysis: Analysis) -> list[str]:
    """List what was fixed beforehand, deviations from the plan, unblinding and attached files."""
    lines = [f"Limits were fixed before the first run: {_limits(session)}."]
    lines += deviations(protocol, analysis, session.states())
    if protocol.blind:
        when = f"unblinded {session.unblinded}" if session.unblinded else "still blind"
        lines.append(f"Blind session: {when}.")
    return [*lines, *_attached(session)]


def _limits(session: Reader) -> str:
    if next(session.byte_log(), None) is None:
        return "unknown; the edges were imported"
    return _FIXED[session.chain().protocol_first]


def _attached(session: Reader) -> Iterator[str]:
    for file in session.attachments():
        yield f"Attached {file.added}: {file.name}, {len(file.data)} bytes."
