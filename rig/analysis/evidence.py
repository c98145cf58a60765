"""Estimation of variance components of the nuisance parameters (empirical Bayes).

For a component s with posterior estimates x_i ± √v_i, the edges determine γ = Σ(1 − v_i/s²)
members. The evidence for s is largest at s² = Σx_i²/γ (MacKay 1992). An estimate and its v give
the likelihood of a member by the edges alone. So x_i and v_i follow for any other s, and s is found
in a single round instead of dozens. The stated value S is the scale of a half-Cauchy prior of s
(Gelman 2006). By an EM step this prior acts as two more members, whose square is the harmonic mean
of S² and s². With few determined members s stays near S; with many, a much too large S has little
influence. If several components add up to a variance, each is multiplied by the share of Σx² that
it explains (also an EM step), which keeps all positive. No component falls below a share of S.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from rig.analysis.components import LEAST_SHARE, Components, above
from rig.analysis.drop_model import DropModel
from rig.analysis.equations import STRAY, Residuals
from rig.arrays import Array

STATED_WEIGHT = 2.0
"""Members that a stated uncertainty counts for: a scale known to 50 % (GUM G.4.2)."""
_KINDS = ("stretch", "gates", "rods", "beam", "hang", "swing")
_IMPULSES = ("impulse", "impulse_floor", "bounce")
_EDGES = ("jitter", "floor", "departure")
_LEAVES = {"departure", "stretch"}  # departures of chains from the model's equations
_DOUBTED = 2.0
"""Least share of every other component, in units of the estimated share of the stated departures;
half or three halves of this factor change no coverage by more than a percentage point."""
_INNER = 10  # steps; the next round of the joint fit continues
_BINS = 64


class Evidence:
    """Accumulator of a session's estimates and residuals, for new variance components.

    Parameters
    ----------
    components
        Components of the current solution.
    stated
        Components of the protocol.

    Attributes
    ----------
    components
        After `estimate_components`, the new components.
    degrees
        Degrees of freedom of each component.
    """

    def __init__(self, components: Components, stated: Components) -> None:
        self.components = components
        self.stated = stated
        self.degrees = {name: STATED_WEIGHT for name in (*_EDGES, *_KINDS) if getattr(stated, name)}
        self._members: dict[tuple[str, ...], list[Array]] = {}
        self._edges: list[tuple[Array, Array, Array]] = []

    def members(self, kind: str, y: Array, covariance: Array) -> None:
        """Add a block of unknowns, in units of their prior uncertainties.

        Parameters
        ----------
        kind
            Component that scales their prior; empty for a block without a variance component.
        y, covariance
            Estimates, and their covariance, which is diagonalized here; of many drops with these
            as a first dimension.
        """
        if kind and y.size:
            variances, sums = np.linalg.eigh(covariance)
            told = np.maximum(1.0 - variances, np.finfo(float).eps)
            size = np.full(y.size, getattr(self.components, kind) ** -2)
            squares = ((y[..., None, :] @ sums)[..., 0, :] / told) ** 2
            rows = [size, squares.ravel(), (variances / told).ravel(), np.ones(y.size)]
            self._members.setdefault((kind,), []).append(np.stack(rows))

    def drops(
        self, model: DropModel, y: Array, told: Array, covariances: Mapping[str, Array]
    ) -> None:
        """Add the own unknowns of drops of a condition.

        Parameters
        ----------
        y, told
            Estimates in units of their prior uncertainties, and the share of each prior variance
            that the edges remove; shape ``(drops, unknowns)``.
        covariances
            Covariances of blocks with a variance component, as in `members`.
        """
        at = model.unknowns
        for name, covariance in covariances.items():
            # After the first strike, other departures of a chain look like swing.
            if name in at and name != "impact swing":
                self.members(at.rows[name].scale, y[:, at[name]], covariance)
        if "impulses" in at:
            # Convert to units of α², as conditions may differ in α.
            block, alpha = at["impulses"], abs(model.alpha)
            squares = (y[:, block] * at.sd[block]) ** 2
            record, size = model.records["impact"], np.full(squares.shape, alpha**2)
            single = size / above(record.chain.chain) ** 2
            rows = [size, np.ones_like(size), single, squares, np.zeros_like(size), told[:, block]]
            self._members.setdefault(_IMPULSES, []).append(np.stack(rows).reshape(len(rows), -1))

    def edges(self, residuals: Iterable[Residuals]) -> None:
        """Add residuals of edges outside flickers.

        Edges of rods that may have struck are left out: other components dominate these.
        """
        sizes = self.components
        for row in residuals:
            usual = sizes.floor**2 + (row.speed * sizes.jitter) ** 2 + sizes.departures(row.loose)
            good = row.clean & (np.abs(row.values) <= STRAY * row.sigma)
            good &= row.sigma**2 <= 2.0 * usual
            self._edges.append((row.values[good] ** 2, row.speed[good] ** 2, row.loose[good]))

    def estimate_components(self, parameters: float, struck: float) -> None:
        """Estimate the components.

        Parameters
        ----------
        parameters
            Number of unknowns that the edges determine.
        struck
            Number of these that only edges after a first impact can determine.
        """
        new: dict[str, float] = {name: getattr(self.components, name) for name in _EDGES}
        edges = self._bin_squares(parameters, struck)
        if edges.size:  # else all are those of rods that may have struck
            self._share(_EDGES, edges, new)
        for names, members in self._members.items():
            self._share(names, np.concatenate(members, axis=1), new)
        # If chains depart from the equations, that may bias every other component.
        parted = new["departure"] / self.stated.departure if self.stated.departure else 0.0
        if "stretch" in new:
            new["stretch"] = max(new["stretch"], _least_share(parted - LEAST_SHARE))
        least = _least_share(max(parted, new.get("stretch", 0.0)))
        for name in new.keys() - _LEAVES:
            new[name] = max(new[name], least * getattr(self.stated, name))
        new["few"] = parted * self.stated.few
        # Rods strike early, and lose speed by it: two departures, and a delay is their product.
        self.components = replace(self.components, landed=least**2, **new)

    def _bin_squares(self, parameters: float, struck: float) -> Array:
        """Bin edges of equal variance: similar speed, same number of falling rods.

        Returns
        -------
        ndarray
            Three rows with the coefficient of each component in each bin, then sums of squares,
            their variances (zero) and degrees of freedom; shape ``(6, bins)``.
        """
        squares, speeds, loose = (np.concatenate(part) for part in zip(*self._edges, strict=True))
        self._edges.clear()
        order, places = np.lexsort((speeds, loose)), np.arange(loose.size)
        changes = np.diff(loose[order], prepend=-1.0) != 0.0
        # A few bins give the same result as all edges.
        begins = np.flatnonzero(changes | (places % max(1, loose.size // _BINS) == 0))
        columns = [squares, speeds, self.stated.departures(loose), loose > 0.0]
        sums = np.add.reduceat(np.array(columns)[:, order], begins, axis=1)
        counts = np.diff(begins, append=loose.size).astype(np.float64)
        _, middles, departed, late = sums / counts
        departed /= self.stated.departure**2 or 1.0
        # Each determined unknown uses a degree of freedom, spread evenly over all speeds.
        total, behind = max(1, squares.size), max(1, int((loose > 0.0).sum()))
        taken = (parameters - struck) / total + late * struck / behind
        degrees = np.maximum(0.5, 1.0 - taken) * counts
        kinds = middles, np.ones_like(middles), departed
        return np.stack([*kinds, sums[0], np.zeros_like(middles), degrees])

    def _share(self, names: Sequence[str], members: Array, new: dict[str, float]) -> None:
        """Estimate the components a of a variance s² = Σ kinds·a².

        A member x ± e has the posterior mean x·s²/(s² + e²) and the share s²/(s² + e²) of a degree
        of freedom. The variances maximize the χ² likelihood of the squares, above the lower bounds
        of a, by multiplicative steps.
        """
        kinds, (squares, unsure, counts) = members[:-3], members[-3:]
        stated = np.array([getattr(self.stated, name) ** 2 for name in names])
        variances = np.array([getattr(self.components, name) ** 2 for name in names])
        # Spread the prior's members over all rows, so that no component is favoured.
        beforehand = STATED_WEIGHT / squares.size
        tiny = np.finfo(float).tiny
        for _ in range(_INNER):
            total = variances @ kinds
            share = total / (total + unsure)
            member = 2.0 * stated * variances / (stated + variances + tiny)  # 0 if exact
            estimates = squares * share**2 + beforehand * (member @ kinds)
            degrees = counts * share + beforehand
            grown = kinds @ (estimates / total**2) / np.maximum(kinds @ (degrees / total), tiny)
            variances = np.maximum(variances * grown, LEAST_SHARE**2 * stated)
        for name, sizes, variance in zip(names, kinds, variances.tolist(), strict=True):
            new[name] = variance**0.5
            self.degrees[name] = max(STATED_WEIGHT, float(degrees[sizes > 0.0].sum()))


def _least_share(parted: float) -> float:
    """Return the least share of a stated component, given the share of estimated departures."""
    return max(LEAST_SHARE, min(1.0, _DOUBTED * parted))
