"""The model's prediction for a scene, with or without a surface."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from rig.measurands import Measurand
from rig.model.fall import air_legs
from rig.units import Quantity


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
    slopes
        By input of α, the change of each measurand with one standard uncertainty of it.
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
    slopes: Mapping[str, Mapping[str, float]] = field(default_factory=dict, repr=False)
    struck: bool = True

    @property
    def label(self) -> str:
        """Incline, name of the striking chain if chains differ, and what else is set."""
        chain = f" {self.impact_chain}" if self.impact_chain else ""
        return f"{self.incline_deg:g}°{chain}{self.setting and f', {self.setting}'}"

    def quantities(self, *rows: Measurand) -> dict[str, Quantity]:
        """Return the predictions of some measurands by JSON name, without absent ones."""
        return {
            row.name: Quantity(value, getattr(self, row.key("u")) or 0.0)
            for row in rows
            if (value := getattr(self, row.name)) is not None
        }

    def json(self) -> dict[str, Any]:
        """Return the object that ``rig predict --json`` prints, without absent quantities."""
        absent = {"slopes", "struck", "fall_time_u_s"}
        absent |= set() if self.struck else {"separation_u_m", "speed_u_m_s"}
        absent |= {name for name in ("impact_chain", "setting") if not getattr(self, name)}
        return {name: value for name, value in asdict(self).items() if name not in absent}


def predict_free_fall(
    scene: str, length: float, gravity: float, initial_speed: float, kappas: Sequence[float]
) -> PredictedIncline:
    """Predict the fall of a chain that strikes nothing.

    Parameters
    ----------
    scene
        Name of the model without air.
    length
        Of the fall, m.
    gravity, initial_speed
        m/s² and m/s.
    kappas
        As in `rig.model.predict.predict`.
    """
    speed, time = air_legs(kappas)(length, initial_speed, gravity, 0)
    return PredictedIncline(
        incline_deg=0.0,
        model=f"{scene}, drag" if kappas else scene,
        speed_m_s=speed,
        fall_time_s=time,
        free_fall_speed_m_s=speed,
        in_domain=True,
        notes=[],
        struck=False,
    )


def group_notes(lines: Iterable[PredictedIncline]) -> list[str]:
    """Return each note once, with the inclines that have it."""
    labels: dict[str, list[str]] = {}
    for line in lines:
        for note in line.notes:
            labels.setdefault(note, []).append(line.label)
    return [f"{', '.join(inclines)}: {note}" for note, inclines in labels.items()]
