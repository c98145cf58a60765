"""What a drop says by itself, to be kept: as plain data, and back to the last bit."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

from rig.analysis.edge_classes import UnmatchedEdge
from rig.analysis.gate_passages import GatePassage
from rig.analysis.result import Audit, Deviation, DropResult, Measured
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
        one = self.result
        result = _members(one) | {
            "run": _members(one.run),
            "audit": _members(one.audit),
            "quantities": _each(one.quantities),
            "matches": [*one.matches.items()],
            "unmatched": [_members(edge) for edge in one.unmatched],
            "last_passages": _each(one.last_passages),
            "gates": [
                _members(gate)
                | {
                    "speed": _members(gate.speed),
                    "interval": None if gate.interval is None else _members(gate.interval),
                }
                for gate in one.gates
            ],
        }
        return {"hz": self.hz, "result": result}

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


def _members(one: Any) -> dict[str, Any]:
    """Name what a record has; `dataclasses.asdict` copies every number, which takes long."""
    return {each.name: getattr(one, each.name) for each in fields(one)}


def _each(measured: Mapping[str, Measured]) -> dict[str, Any]:
    return {name: _members(one) for name, one in measured.items()}


def _by_name(said: Mapping[str, Any]) -> dict[str, Measured]:
    return {name: _measured(one) for name, one in said.items()}


def _measured(said: Mapping[str, Any]) -> Measured:
    deviation = said["deviation"]
    return Measured(**{**said, "deviation": deviation and Deviation(*deviation)})


def _passage(speed: Any, interval: Any, **said: Any) -> GatePassage:
    since = None if interval is None else _measured(interval)
    return GatePassage(speed=_measured(speed), interval=since, **said)
