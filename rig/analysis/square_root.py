"""Linear least squares by square roots: a normal matrix would lose half of the digits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rig.arrays import Array, Index

_MANY = 16
"""Rows for each unknown that are reduced at once: as quick as all rows, and a few MB."""


class EquationRows(NamedTuple):
    """Linearized residuals ``left + slopes @ d[columns]`` for a step d, in standard deviations.

    Attributes
    ----------
    slopes
        Derivatives, shape ``(rows, columns)``; of many drops ``(drops, rows, columns)``.
    left
        Residuals for d = 0, shape ``(rows,)``, or ``(drops, rows)``.
    columns
        Places of the unknowns that they depend on; shape ``(columns,)``.
    """

    slopes: Array
    left: Array
    columns: Index

    def triangle(self) -> EquationRows:
        """Return equivalent rows, at most as many as columns plus one, by QR."""
        reduced = triangle(np.column_stack([self.slopes, self.left]))
        return self._replace(slopes=reduced[:, :-1], left=reduced[:, -1])

    def after(self, step: Array) -> EquationRows:
        """Return the rows linearized at the point after a step."""
        return self._replace(left=self.left + self.slopes @ step[self.columns])


class Root(NamedTuple):
    """A square root R of an information matrix RᵀR, with residuals ``left + matrix @ d``.

    Attributes
    ----------
    matrix
        R, shape ``(unknowns, unknowns)``; triangular up to the order of its columns.
    left
        Residuals for d = 0, shape ``(unknowns,)``.
    """

    matrix: Array
    left: Array

    def step(self) -> Array:
        """Return the step to the least sum of squares."""
        return np.asarray(np.linalg.solve(self.matrix, -self.left), dtype=np.float64)

    def damp(self, damping: float) -> Root:
        """Return the root of RᵀR + λ·diag(RᵀR) (Marquardt 1963)."""
        lengths = np.sqrt(damping) * np.linalg.norm(self.matrix, axis=0)
        stack = np.column_stack([self.matrix, self.left])
        longer = np.column_stack([np.diag(lengths), 0.0 * self.left])
        stack = triangle(np.concatenate([stack, longer]))
        return Root(stack[:-1, :-1], stack[:-1, -1])


class Elimination(NamedTuple):
    """Unknowns o eliminated from observations of o and c: best o = own − gain·c.

    Of many drops, each array has their number as a first dimension.

    Attributes
    ----------
    inverse
        R⁻¹ of the eliminated unknowns; their covariance given the others is R⁻¹R⁻ᵀ.
    gain, own
        As above.
    rest
        Remaining observations of c.
    """

    inverse: Array
    gain: Array
    own: Array
    rest: EquationRows


def square_root(blocks: Sequence[EquationRows], sd: Array, pull: Array) -> Root:
    """Reduce observations and priors to a square root.

    Parameters
    ----------
    blocks
        Observations in the unknowns' own units.
    sd
        Prior standard uncertainties, units of the root; 0 holds an unknown fixed.
    pull
        Deviations of the unknowns from their prior means, in these units.
    """
    all_places = np.arange(sd.size)
    matrix, _ = _reduce(blocks, sd, pull, all_places, all_places[:0])
    return Root(matrix[:, :-1], matrix[:, -1])


def eliminate(
    blocks: Sequence[EquationRows], sd: Array, pull: Array, own: Index, common: Index
) -> Elimination:
    """Eliminate some unknowns, priors of these included.

    Parameters
    ----------
    blocks, sd, pull
        As for `square_root`; blocks of many drops, and a pull of each, shape ``(drops, unknowns)``.
    own, common
        Places of the unknowns to eliminate, and of all others.
    """
    matrix, rest = _reduce(blocks, sd, pull, own, common)
    inverse = np.linalg.inv(matrix[..., own]).astype(np.float64, copy=False)
    beside = inverse @ matrix[..., np.append(common, sd.size)]
    return Elimination(inverse, beside[..., :-1], -beside[..., -1], rest)


def condense(blocks: list[EquationRows], size: int) -> list[EquationRows]:
    """Return equivalent observations; many rows are reduced to a triangle.

    Parameters
    ----------
    size
        Number of unknowns.
    """
    if sum(block.left.size for block in blocks) <= _MANY * size:
        return blocks
    columns = np.arange(size)
    reduced = _stack_blocks(blocks, columns, np.zeros(0))
    return [EquationRows(reduced[:, :-1], reduced[:, -1], columns)]


def _reduce(
    blocks: Sequence[EquationRows], sd: Array, pull: Array, own: Index, common: Index
) -> tuple[Array, EquationRows]:
    """Return the triangle of the unknowns `own` with their priors, and what is left of the others.

    Unknowns in a single block are eliminated first. Residuals are in the last column.
    """
    size, drops = sd.size, pull.shape[:-1]
    block_count = np.zeros(size, dtype=np.intp)
    for block in blocks:
        block_count[block.columns] += 1
    private = np.zeros(size, dtype=np.bool_)
    private[own] = block_count[own] == 1
    matrix, begin = np.zeros((*drops, own.size, size + 1)), 0
    rest = []
    for block in blocks:
        is_private = private[block.columns]
        order = np.concatenate([np.flatnonzero(is_private), np.flatnonzero(~is_private)])
        columns, count, rows = block.columns[order], int(is_private.sum()), block.left.shape[-1]
        stack = np.zeros((*drops, rows + count, order.size + 1))
        np.multiply(block.slopes[..., order], sd[columns], out=stack[..., :rows, :-1])
        stack[..., :rows, -1] = block.left
        stack[..., rows + np.arange(count), np.arange(count)] = 1.0
        stack[..., rows:, -1] = pull[..., columns[:count]]
        stack = triangle(stack)
        matrix[..., begin : begin + count, np.append(columns, size)] = stack[..., :count, :]
        begin += count
        stack = stack[..., count:, count:]
        rest.append(EquationRows(stack[..., :-1], stack[..., -1], columns[count:]))
    several = own[~private[own]]
    columns = np.concatenate([several, common])
    last = _stack_blocks(rest, columns, pull[..., several])
    matrix[..., begin:, np.append(columns, size)] = last[..., : several.size, :]
    last = last[..., several.size :, several.size :]
    return matrix, EquationRows(last[..., :-1], last[..., -1], common)


def _stack_blocks(blocks: Sequence[EquationRows], columns: Index, pull: Array) -> Array:
    """Return the triangle of blocks and priors of the first columns, residuals in the last."""
    place = np.full(int(columns.max(initial=-1)) + 1, -1)
    place[columns] = np.arange(columns.size)
    rows, count = sum(block.left.shape[-1] for block in blocks), pull.shape[-1]
    stack = np.zeros((*pull.shape[:-1], rows + count, columns.size + 1))
    end = 0
    for block in blocks:
        begin, end = end, end + block.left.shape[-1]
        stack[..., begin:end, place[block.columns]] = block.slopes
        stack[..., begin:end, -1] = block.left
    stack[..., end + np.arange(count), np.arange(count)] = 1.0
    stack[..., end:, -1] = pull
    return triangle(stack)


def triangle(rows: Array) -> Array:
    """Return R of the QR decomposition of rows, or of those of each drop."""
    factor: Array = np.asarray(np.linalg.qr(rows, mode="r"))
    return factor
