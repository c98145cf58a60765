"""A bad line: bytes that change or vanish on the way, reproducible from a seed."""

from __future__ import annotations

import random


class LineFaults:
    """Damages bytes.

    Parameters
    ----------
    corrupt, lose
        Probability, for each byte, of becoming another one, and of vanishing.
    seed
        Same seed, same damage.
    """

    def __init__(self, corrupt: float = 0.0, lose: float = 0.0, seed: int = 0) -> None:
        self._corrupt = corrupt
        self._lose = lose
        self._random = random.Random(f"line {seed}")  # noqa: S311 - noise, not secrets

    def damage(self, data: bytes) -> bytes:
        """Pass bytes over the line.

        Parameters
        ----------
        data
            As sent.

        Returns
        -------
        bytes
            As received.
        """
        if not (self._corrupt or self._lose):
            return data
        out = bytearray()
        for byte in data:
            chance = self._random.random()
            if chance < self._lose:
                continue
            if chance < self._lose + self._corrupt:
                out.append(byte ^ self._random.randrange(1, 256))
            else:
                out.append(byte)
        return bytes(out)
