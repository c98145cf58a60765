"""What the model says of one scene, with or without a surface."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class PredictedIncline:
    """What the model says of one incline; `None` is what the scene does not have or tell.

    Attributes
    ----------
    incline_deg, impact_chain
        What it is of; a chain is named where two are unlike.
    model, alpha, gamma
        What was computed, and the coefficients of Eq. 9.
    separation_m, separation_u_m, speed_m_s, speed_u_m_s
        Δz and V with the standard uncertainties that follow from those of β, μ (or α), drop,
        gravity, initial speed and drag; without them also where Eq. 13 is singular within the
        uncertainty of μ.
    fall_time_s, fall_time_u_s, free_fall_speed_m_s
        Until the top rod strikes; and how fast it would be without any impact.
    in_domain, notes
        Whether the model describes the case, and what there is to say.
    struck
        Whether the scene has a surface; without one nothing has an uncertainty.
    """

    incline_deg: float
    impact_chain: str | None = None
    model: str
    alpha: float | None = None
    gamma: float | None = None
    separation_m: float | None = None
    separation_u_m: float | None = None
    speed_m_s: float | None = None
    speed_u_m_s: float | None = None
    fall_time_s: float | None = None
    fall_time_u_s: float | None = None
    free_fall_speed_m_s: float
    in_domain: bool
    notes: list[str]
    struck: bool = True

    @property
    def label(self) -> str:
        """Its incline and, where chains are unlike, the one that strikes."""
        return f"{self.incline_deg:g}°{f' {self.impact_chain}' if self.impact_chain else ''}"

    def json(self) -> dict[str, Any]:
        """As ``rig predict --json`` prints it, without what the scene does not have."""
        absent = {"struck", "fall_time_u_s"}
        absent |= set() if self.struck else {"separation_u_m", "speed_u_m_s"}
        absent |= set() if self.impact_chain else {"impact_chain"}
        return {name: value for name, value in asdict(self).items() if name not in absent}
