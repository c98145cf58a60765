"""The model's prediction for a scene, with or without a surface."""

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class PredictedIncline:
    """Prediction for an incline; `None` for quantities that do not apply.

    Attributes
    ----------
    incline_deg, impact_chain, setting
        Incline, name of the striking chain if chains differ, and what else the plan varies.
    model, alpha, gamma
        Name of the model, and the coefficients of Eq. 9.
    separation_m, separation_u_m, speed_m_s, speed_u_m_s
        Δz and V with their standard uncertainties from those of β, μ (or α), drop height, gravity,
        initial speed and drag; no uncertainties if Eq. 13 is singular within that of μ.
    fall_time_s, fall_time_u_s, free_fall_speed_m_s
        Time until the top rod strikes, and its speed then without any impacts.
    in_domain, notes
        Whether the case is in the model's domain, and remarks.
    struck
        Whether the scene has a surface; without a surface there are no uncertainties.
    """

    incline_deg: float
    impact_chain: str | None = None
    setting: str = ""
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
        """Incline, name of the striking chain if chains differ, and what else is set."""
        chain = f" {self.impact_chain}" if self.impact_chain else ""
        return f"{self.incline_deg:g}°{chain}{self.setting and f', {self.setting}'}"

    def json(self) -> dict[str, Any]:
        """Return the object that ``rig predict --json`` prints, without absent quantities."""
        absent = {"struck", "fall_time_u_s"}
        absent |= set() if self.struck else {"separation_u_m", "speed_u_m_s"}
        absent |= {name for name in ("impact_chain", "setting") if not getattr(self, name)}
        return {name: value for name, value in asdict(self).items() if name not in absent}
