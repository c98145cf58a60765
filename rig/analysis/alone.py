"""What a drop says by itself, to be kept: as plain data, and back to the last bit."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from rig.analysis.edge_classes import UnmatchedEdge
from rig.analysis.gate_passages import GatePassage
from rig.analysis.result import Audit, DropResult, Measured
from rig.protocol.protocol import Run

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True, slots=True)
class Alone:
    """What a drop says by itself.

    Attributes
    ----------
    hz
        At which tick rate.
    result
        By the protocol's own components of uncertainty.
    """

    hz: float
    result: DropResult

    def json(self) -> dict[str, Any]:
        """Return it so that `read` gives the same, to the last bit."""
        said = asdict(self.result)
        return {"hz": self.hz, "result": said | {"matches": [*said["matches"].items()]}}

    @classmethod
    def read(cls, said: Mapping[str, Any]) -> Alone:
        """Take it from what `json` returned."""
        kept = said["result"]
        result = DropResult(
            **kept
            | {
                "run": Run(**kept["run"]),
                "reasons": tuple(kept["reasons"]),
                "audit": Audit(**kept["audit"]),
                "quantities": _by_name(kept["quantities"]),
                "matches": dict(kept["matches"]),
                "unmatched": tuple(UnmatchedEdge(**edge) for edge in kept["unmatched"]),
                "last_passages": _by_name(kept["last_passages"]),
                "gates": tuple(_passage(**one) for one in kept["gates"]),
            }
        )
        return cls(said["hz"], result)


def _by_name(said: Mapping[str, Any]) -> dict[str, Measured]:
    return {name: Measured(**one) for name, one in said.items()}


def _passage(speed: Any, interval: Any, **said: Any) -> GatePassage:
    since = None if interval is None else Measured(**interval)
    return GatePassage(speed=Measured(**speed), interval=since, **said)
