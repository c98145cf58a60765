"""What a check found."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the doctor's; with an advice it is a trouble, without one all is well."""

    name: str
    what: str
    advice: str = ""

    def __str__(self) -> str:
        if self.advice:
            return f"{self.name}: {self.what}\n  do: {self.advice}"
        return f"{self.name}: {self.what}"
