"""What a blind session keeps back until it is unblinded: here, below all that shows results.

A protocol with ``blind: true`` is blind by what it says itself, and until `Session.unblind` has put
the moment into the session file, once. Until then of a drop is told how it was let go, which edges
there were and whether it counts; not what was measured, nor means, fits and what follows from them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from rig.analysis.session import Analysis
from rig.errors import SessionError
from rig.measurands import RELEASE_SKEW
from rig.reasons import make_error

if TYPE_CHECKING:
    from rig.analysis.result import DropResult
    from rig.protocol.protocol import Protocol
    from rig.session.reading import Reader


def kept_back(session: Reader, protocol: Protocol) -> bool:
    """Whether a session's numbers must not be seen yet."""
    return protocol.blind and not session.unblinded


def check_open(session: Reader, protocol: Protocol) -> None:
    """Refuse to work with numbers that must not be seen yet.

    Raises
    ------
    SessionError
        The session is blind.
    """
    if kept_back(session, protocol):
        raise make_error(SessionError, "session_blind", path=str(session.path))


def veiled_drop(result: DropResult) -> DropResult:
    """Leave out what a drop measured."""
    shown_names = {RELEASE_SKEW.name} & result.quantities.keys()
    return replace(
        result,
        quantities={name: result.quantities[name] for name in shown_names},
        matches={},
        unmatched=(),
        last_passages={},
        gates=(),
        alone={},
        gravity=None,
    )


def veiled(analysis: Analysis) -> Analysis:
    """Leave out what drops measured, and all that follows from it."""
    return Analysis(
        tuple(map(veiled_drop, analysis.runs)), tuple(map(veiled_drop, analysis.superseded)), ()
    )
