"""What was stated before the first run, and where the session departed from it later."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.report.deviations import deviations

if TYPE_CHECKING:
    from rig.analysis.session import Analysis
    from rig.protocol.protocol import Protocol
    from rig.session.reading import Reader


def describe_history(session: Reader, protocol: Protocol, analysis: Analysis) -> list[str]:
    """List deviations from the plan and the moment of unblinding, one sentence each."""
    lines = deviations(protocol, analysis, session.states())
    if protocol.blind:
        when = f"unblinded {session.unblinded}" if session.unblinded else "still blind"
        lines.append(f"Blind session: {when}.")
    return lines
