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
        self._random = random.Random(f"line {seed}")

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
            hurt = chance < self._lose + self._corrupt
            out.append(byte ^ self._random.randrange(1, 256) if hurt else byte)
        return bytes(out)


class BadLine:
    """Both directions of a line.

    Parameters
    ----------
    corrupt, lose
        As in `LineFaults`, of either direction.
    busy
        Probability, for each byte, of becoming another one, while the other direction is under way.
    seed
        Same seed, same damage.
    """

    def __init__(self, corrupt: float, lose: float, busy: float, seed: int) -> None:
        self._to_board = LineFaults(corrupt, lose, 2 * seed)
        self._to_host = LineFaults(corrupt, lose, 2 * seed + 1)
        self._both = LineFaults(corrupt=busy, seed=seed)

    def transfer(self, to_host: bytes, to_board: bytes) -> tuple[bytes, bytes]:
        """Pass on what is sent both ways at the same time."""
        to_host, to_board = self._to_host.damage(to_host), self._to_board.damage(to_board)
        if to_host and to_board:
            return self._both.damage(to_host), self._both.damage(to_board)
        return to_host, to_board
