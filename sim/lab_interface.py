"""What the virtual microcontroller sees of the lab around it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Sequence


class Lab(Protocol):
    """The chains and beams in front of the gates."""

    def rest(self, label: int) -> int:
        """Say which beams are blocked while the chains hang.

        Parameters
        ----------
        label
            Of the drop that is being prepared.

        Returns
        -------
        int
            Gate mask, 1 = blocked.
        """
        ...

    def drop(self, label: int) -> Sequence[tuple[float, int, bool]]:
        """Let go.

        Parameters
        ----------
        label
            Of the drop.

        Returns
        -------
        sequence of (seconds after the release fired, channel, blocked)
            Every change of every beam, in order of time.
        """
        ...
