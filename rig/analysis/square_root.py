"""Linear least squares on square roots: QR keeps the digits of which a normal matrix loses half."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.arrays import Array, Index


_MANY = 16
"""Rows an unknown that are reduced at once: as quick as all of them, and a few MB."""


class EquationRows(NamedTuple):
    """Observations in standard deviations: for a step d they leave ``left + slopes @ d[columns]``.

    Attributes
    ----------
    slopes
        Shape ``(rows, columns)``.
    left
        Shape ``(rows,)``.
    columns
        Which unknowns they depend on; shape ``(columns,)``.
    """

    slopes: Array
    left: Array
    columns: Index

    def triangle(self) -> EquationRows:
        """Return the same sum of squares of any step, in no more rows than columns and one."""
        reduced = triangle(np.column_stack([self.slopes, self.left]))
        return self._replace(slopes=reduced[:, :-1], left=reduced[:, -1])

    def after(self, step: Array) -> EquationRows:
        """Return the same about the point that a step leads to."""
        return self._replace(left=self.left + self.slopes @ step[self.columns])


class Root(NamedTuple):
    """A square root R of an information matrix RᵀR, and what R·d leaves: ``left + matrix @ d``.

    Attributes
    ----------
    matrix
        Shape ``(unknowns, unknowns)``; a triangle but for the order of its columns.
    left
        Shape ``(unknowns,)``.
    """

    matrix: Array
    left: Array

    def step(self) -> Array:
        """Return the step to the least sum of squares."""
        return np.asarray(np.linalg.solve(self.matrix, -self.left), dtype=np.float64)

    def pulled(self, gradient: Array) -> Array:
        """Return the step that balances a further gradient."""
        step = np.linalg.solve(self.matrix, np.linalg.solve(self.matrix.T, -gradient))
        return np.asarray(step, dtype=np.float64)

    def damped(self, damping: float, lengths: Array) -> Root:
        """Return the root with λ times the squares of its columns' lengths (Marquardt 1963)."""
        size = self.left.size
        stack = np.zeros((2 * size, size + 1))
        stack[:size, :size], stack[:size, size] = self.matrix, self.left
        stack[size + np.arange(size), np.arange(size)] = np.sqrt(damping) * lengths
        stack = triangle(stack)
        return Root(stack[:size, :size], stack[:size, size])


class Eliminated(NamedTuple):
    """Some unknowns o eliminated from observations of these and others c: o = own − gain·c.

    Attributes
    ----------
    inverse
        R⁻¹ of the eliminated ones, of which the covariance given the others is R⁻¹R⁻ᵀ.
    gain, own
        As above.
    rest
        What is left to say of the others.
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
        In the unknowns' own units. What only one of them knows of is eliminated from it first.
    sd
        Prior standard uncertainties: the root's units; where 0 an unknown stays as it is.
    pull
        How far the unknowns are above their prior means, in these units.
    """
    matrix, top, rest = _eliminate_private(blocks, sd, pull, np.arange(sd.size))
    columns = np.setdiff1d(np.arange(sd.size), top, assume_unique=True)
    last = _stacked(rest, columns, pull[columns])
    matrix[top.size :, np.append(columns, sd.size)] = last[: columns.size]
    return Root(matrix[:, :-1], matrix[:, -1])


def eliminate(
    blocks: Sequence[EquationRows], sd: Array, pull: Array, own: Index, common: Index
) -> Eliminated:
    """Eliminate some unknowns, priors of these included.

    Parameters
    ----------
    blocks, sd, pull
        As for `square_root`.
    own, common
        Those that are eliminated, and all others.
    """
    matrix, top, rest = _eliminate_private(blocks, sd, pull, own)
    rest_of_own = np.setdiff1d(own, top, assume_unique=True)
    columns = np.concatenate([rest_of_own, common, [sd.size]])
    last = _stacked(rest, columns[:-1], pull[rest_of_own])
    matrix[top.size : own.size, columns] = last[: rest_of_own.size]
    inverse = np.linalg.inv(matrix[: own.size, own]).astype(np.float64, copy=False)
    beside = inverse @ matrix[: own.size, columns[rest_of_own.size :]]
    last = last[rest_of_own.size :, rest_of_own.size :]
    return Eliminated(
        inverse, beside[:, :-1], -beside[:, -1], EquationRows(last[:, :-1], last[:, -1], common)
    )


def condensed(blocks: list[EquationRows], size: int) -> list[EquationRows]:
    """Return the same sum of squares in few rows: where there are many they become a triangle.

    Parameters
    ----------
    size
        Number of unknowns.
    """
    if sum(block.left.size for block in blocks) <= _MANY * size:
        return blocks
    columns = np.arange(size)
    reduced = _stacked(blocks, columns, np.zeros(0))
    return [EquationRows(reduced[:, :-1], reduced[:, -1], columns)]


def _eliminate_private(
    blocks: Sequence[EquationRows], sd: Array, pull: Array, among: Index
) -> tuple[Array, Index, list[EquationRows]]:
    """Eliminate from each block those of some unknowns that no other block knows of.

    Returns
    -------
    whole, top, rest
        Triangles of these, one below the other and the left sides behind, shape ``(unknowns,
        unknowns + 1)``; their columns; and what each block says of other unknowns.
    """
    size = sd.size
    block_count = np.zeros(size, dtype=np.intp)
    for block in blocks:
        block_count[block.columns] += 1
    private = np.zeros(size, dtype=np.bool_)
    private[among] = block_count[among] == 1
    matrix, begin = np.zeros((size, size + 1)), 0
    top, rest = [], []
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
        top.append(columns[:count])
        rest.append(EquationRows(stack[count:, count:-1], stack[count:, -1], columns[count:]))
    return matrix, np.concatenate([np.zeros(0, dtype=np.intp), *top]), rest


def _stacked(blocks: Sequence[EquationRows], columns: Index, pull: Array) -> Array:
    """Stack blocks and the priors of the first columns to a triangle, the left side behind."""
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
    """Return R of rows QR, with the same sum of squares of any step."""
    factor: Array = np.asarray(np.linalg.qr(rows, mode="r"))
    return factor
