"""Linear least squares by square roots: a normal matrix would lose half of the digits."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.arrays import Array, Flags, Index


_MANY = 16
"""Rows for each unknown that are reduced at once: as quick as all rows, and a few MB."""


class EquationRows(NamedTuple):
    """Linearized residuals ``left + slopes @ d[columns]`` for a step d, in standard deviations.

    Attributes
    ----------
    slopes
        Derivatives, shape ``(rows, columns)``.
    left
        Residuals for d = 0, shape ``(rows,)``.
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

    def gradient_step(self, gradient: Array) -> Array:
        """Return the step −(RᵀR)⁻¹·gradient."""
        step = np.linalg.solve(self.matrix, np.linalg.solve(self.matrix.T, -gradient))
        return np.asarray(step, dtype=np.float64)

    def damp(self, damping: float, lengths: Array) -> Root:
        """Return the root of RᵀR + λ·diag(lengths²) (Marquardt 1963)."""
        size = self.left.size
        stack = np.zeros((2 * size, size + 1))
        stack[:size, :size], stack[:size, size] = self.matrix, self.left
        stack[size + np.arange(size), np.arange(size)] = np.sqrt(damping) * lengths
        stack = triangle(stack)
        return Root(stack[:size, :size], stack[:size, size])


class Elimination(NamedTuple):
    """Unknowns o eliminated from observations of o and c: best o = own − gain·c.

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
        Observations in the unknowns' own units. Unknowns in a single block are eliminated first.
    sd
        Prior standard uncertainties, units of the root; 0 holds an unknown fixed.
    pull
        Deviations of the unknowns from their prior means, in these units.
    """
    matrix, private, rest = _eliminate_private(blocks, sd, pull, np.arange(sd.size))
    columns = np.flatnonzero(~private)
    last = _stack_blocks(rest, columns, pull[columns])
    matrix[sd.size - columns.size :, np.append(columns, sd.size)] = last[: columns.size]
    return Root(matrix[:, :-1], matrix[:, -1])


def eliminate(
    blocks: Sequence[EquationRows], sd: Array, pull: Array, own: Index, common: Index
) -> Elimination:
    """Eliminate some unknowns, priors of these included.

    Parameters
    ----------
    blocks, sd, pull
        As for `square_root`.
    own, common
        Places of the unknowns to eliminate, and of all others.
    """
    matrix, private, rest = _eliminate_private(blocks, sd, pull, own)
    rest_of_own = own[~private[own]]
    columns = np.concatenate([rest_of_own, common, [sd.size]])
    last = _stack_blocks(rest, columns[:-1], pull[rest_of_own])
    matrix[own.size - rest_of_own.size : own.size, columns] = last[: rest_of_own.size]
    inverse = np.linalg.inv(matrix[: own.size, own]).astype(np.float64, copy=False)
    beside = inverse @ matrix[: own.size, columns[rest_of_own.size :]]
    last = last[rest_of_own.size :, rest_of_own.size :]
    return Elimination(
        inverse, beside[:, :-1], -beside[:, -1], EquationRows(last[:, :-1], last[:, -1], common)
    )


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


def _eliminate_private(
    blocks: Sequence[EquationRows], sd: Array, pull: Array, among: Index
) -> tuple[Array, Flags, list[EquationRows]]:
    """Eliminate from each block those of the unknowns `among` that no other block has.

    Returns
    -------
    matrix, private, rest
        Triangles of the eliminated unknowns, stacked, residuals in the last column, shape
        ``(unknowns, unknowns + 1)``; their mask; and each block's rows of other unknowns.
    """
    size = sd.size
    block_count = np.zeros(size, dtype=np.intp)
    for block in blocks:
        block_count[block.columns] += 1
    private = np.zeros(size, dtype=np.bool_)
    private[among] = block_count[among] == 1
    matrix, begin = np.zeros((size, size + 1)), 0
    rest = []
    for block in blocks:
        is_private = private[block.columns]
        order = np.concatenate([np.flatnonzero(is_private), np.flatnonzero(~is_private)])
        columns, count, rows = block.columns[order], int(is_private.sum()), block.left.size
        stack = np.zeros((rows + count, order.size + 1))
        np.multiply(block.slopes[:, order], sd[columns], out=stack[:rows, :-1])
        stack[:rows, -1] = block.left
        stack[rows + np.arange(count), np.arange(count)] = 1.0
        stack[rows:, -1] = pull[columns[:count]]
        stack = triangle(stack)
        matrix[begin : begin + count, np.append(columns, size)] = stack[:count]
        begin += count
        rest.append(EquationRows(stack[count:, count:-1], stack[count:, -1], columns[count:]))
    return matrix, private, rest


def _stack_blocks(blocks: Sequence[EquationRows], columns: Index, pull: Array) -> Array:
    """Return the triangle of blocks and priors of the first columns, residuals in the last."""
    place = np.full(int(columns.max(initial=-1)) + 1, -1)
    place[columns] = np.arange(columns.size)
    stack = np.zeros((sum(block.left.size for block in blocks) + pull.size, columns.size + 1))
    end = 0
    for block in blocks:
        begin, end = end, end + block.left.size
        stack[begin:end, place[block.columns]] = block.slopes
        stack[begin:end, -1] = block.left
    stack[end + np.arange(pull.size), np.arange(pull.size)] = 1.0
    stack[end:, -1] = pull
    return triangle(stack)


def triangle(rows: Array) -> Array:
    """Return R of the QR decomposition of rows."""
    factor: Array = np.asarray(np.linalg.qr(rows, mode="r"))
    return factor
