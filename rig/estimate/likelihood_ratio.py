"""One hypothesis against another in which it is contained."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rig.analysis.distributions import chi2_tail
from rig.analysis.plain_data import attributes


@dataclass(frozen=True, slots=True)
class LikelihoodRatio:
    """A likelihood-ratio test.

    Attributes
    ----------
    change
        By how much χ² is larger for the narrower hypothesis.
    degrees
        How many parameters it has less.
    """

    change: float
    degrees: int

    @property
    def chi2(self) -> float:
        """`change`, which rounding cannot make negative."""
        return max(0.0, self.change)

    @property
    def p(self) -> float | None:
        """How often chance alone would make χ² as large; `None` without degrees of freedom."""
        return chi2_tail(self.chi2, self.degrees) if self.degrees > 0 else None

    def json(self) -> dict[str, Any]:
        """``{"chi2", "degrees", "p"}``."""
        return attributes(self, "chi2", "degrees", "p")
