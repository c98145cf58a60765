"""The forward model of a drop: expected edges, residuals and derivatives given all unknowns."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from rig.analysis.annealing import PART, Pairing, matched
from rig.analysis.chain_records import ChainRecord
from rig.analysis.components import ALPHA_SD, ANY_ALPHA, SHARPEST, Components, priors
from rig.analysis.departures import LOWEST_START, Discrepancy
from rig.analysis.equations import HUBER, SHARED, STRAY, Equations, ExpectedEdges, Residuals, Seen
from rig.analysis.trajectory import (
    COMMON,
    DRAG,
    GRAVITY,
    START,
    Trajectory,
    free_trajectory,
    struck_trajectory,
)
from rig.analysis.unknowns import Unknown, Unknowns, prior_air, side_slopes
from rig.arrays import Array, Flags, Index
from rig.protocol.protocol import Protocol
from rig.units import Quantity

_TOLD = 0.5
"""Share of the prior uncertainty of strike heights that is assumed to remain during a fit. With
0.3 or 0.7 a joint fit takes as many rounds, with 0 or 1 twice as many."""
_RECENT = 8
"""Results kept of drops in work: matching and fitting ask twice for each side."""


class DropModel:
    """One drop: its unknowns and the observation equations of its edges.

    Parameters
    ----------
    protocol
        The scene.
    records
        The chains with their edges.
    clock_u
        Relative standard uncertainty of the time scale.
    components
        Variance components; those of the protocol if not given.
    alpha
        α to which the scatter of single impulses is relative; the protocol's if not given.

    See `DropModel.of`, which is quicker for many drops under the same conditions.

    Attributes
    ----------
    condition
        The same for drops that differ only in their edges.
    directions
        Directions of set-up faults, see `rig.analysis.explanations`, kept for the condition.
    owners
        Suffixes of the names of shared unknowns, by owner, if the drops of a joint fit come from
        different rigs: see `rig.results.together`.
    """

    def __init__(
        self,
        protocol: Protocol,
        records: Sequence[ChainRecord],
        clock_u: float,
        components: Components | None = None,
        alpha: float | None = None,
    ) -> None:
        self.protocol = protocol
        self._kappa: float
        self.kappa_u: float
        self._kappa, self.kappa_u = prior_air(protocol)
        self.records: dict[str, ChainRecord] = {record.role: record for record in records}
        self.alpha: float = records[0].alpha if alpha is None else alpha
        self.clock_u: float = clock_u
        self.components: Components = components or priors(protocol)
        self.suspects: tuple[Unknown, ...] = ()
        self.owners: Mapping[str, str] = {}
        self.condition: object = object()
        self.expected: dict[str, ExpectedEdges] = {
            role: ExpectedEdges.of(record, protocol) for role, record in self.records.items()
        }
        if "impact" in self.records:
            record = self.records["impact"]
            self.discrepancy: Discrepancy = Discrepancy.of(record, protocol, self._kappa)
        self.directions: dict[object, Array] = {}
        self._seen: dict[str, tuple[Index, Seen]] = {}
        self.slopes = {role: side_slopes(self, role) for role in self.records}

    @classmethod
    def of(
        cls,
        protocol: Protocol,
        records: Sequence[ChainRecord],
        clock_u: float,
        alpha: float | None = None,
    ) -> DropModel:
        """Return a drop's model with the protocol's priors; all but its edges is cached."""
        return _model_of(protocol, *(record.blank for record in records)).copy_with(
            records={record.role: record for record in records},
            alpha=records[0].alpha if alpha is None else alpha,
            clock_u=clock_u,
        )

    def copy_with(self, **attributes: Any) -> DropModel:
        """Return a copy with these attributes, and with priors recomputed from them."""
        model = self.with_edges(attributes.pop("records", self.records))
        vars(model).update(attributes)
        vars(model).pop("unknowns", None)
        if "suspects" in attributes:
            model.slopes = {role: side_slopes(model, role) for role in model.records}
        return model

    def with_edges(self, records: Mapping[str, ChainRecord]) -> DropModel:
        """Return a copy with the edges of other records of the same condition."""
        model = copy(self)
        vars(model).update(records=records, _seen={})
        if records is not self.records:
            vars(model).pop("pairings", None)
        return model

    @cached_property
    def unknowns(self) -> Unknowns:
        """Vector of the unknowns."""
        return Unknowns(self)

    @cached_property
    def pairings(self) -> dict[str, Pairing]:
        """Edges of each side, prepared for matching."""
        return {role: Pairing(record) for role, record in self.records.items()}

    def under(self, protocol: Protocol) -> DropModel:
        """Return a copy with the priors of a protocol that differs in nothing else."""
        # Heights stay: they may be relative to a contact point of this drop alone.
        current, gates, level = self.protocol, self.protocol.gates, protocol.contact.level
        kappa, kappa_u = prior_air(protocol)
        return self.copy_with(
            components=priors(protocol),
            protocol=replace(
                protocol,
                drop=Quantity(current.drop.value, protocol.drop.u),
                gates=replace(protocol.gates, gates=gates.gates),
                contact=replace(current.contact, level=replace(current.contact.level, u=level.u)),
                stated=current.stated,
            ),
            _kappa=kappa,
            kappa_u=kappa_u,
            # Rod widths and places carry their priors in the chain.
            records={
                role: replace(record, chain=protocol.chains[record.chain.name])
                for role, record in self.records.items()
            },
        )

    def shaken(self, shifts: Mapping[str, Array]) -> DropModel:
        """Return a copy with each edge shifted in time, s, by role."""
        records = {}
        for role, record in self.records.items():
            times = record.edges.times + shifts[role]
            records[role] = replace(record, edges=record.edges._replace(times=times))
        return self.with_edges(records)

    def rate(self, x: Array) -> Array:
        """Return the factor from stamped times to true times, shape ``(1,)`` or ``(drops, 1)``."""
        return np.asarray(1.0 + (x @ self.unknowns.rate)[..., None])

    def kappa(self, x: Array) -> float:
        """Return κ of the first chain as a whole, 1/m."""
        return self._kappa + float(x[self.unknowns["drag"]][0])

    def trajectory(self, role: str, x: Array) -> Trajectory:
        """Return the trajectory of one side for given unknowns, or those of many drops.

        Parameters
        ----------
        x
            Shape ``(unknowns,)`` or ``(drops, unknowns)``.
        """
        return _path_at(self, role, x.tobytes(), x.shape)

    def _trajectory(self, role: str, x: Array) -> Trajectory:
        record, parameters = self.records[role], x @ self.slopes[role].path.T
        parameters[..., START] += self.protocol.drop.value
        parameters[..., GRAVITY] += self.protocol.gravity.value
        parameters[..., DRAG] += self._kappa
        common = np.moveaxis(parameters[..., :COMMON, None], -2, 0)
        release, start, gravity, kappa = common if x.ndim > 1 else common[:, 0].tolist()
        if not np.all(gravity > 0.0):
            # Nothing falls: NaN keeps a fit from ending here.
            gravity = np.where(gravity > 0.0, gravity, math.nan)
        if record.ratios is None:
            return free_trajectory(release, start, gravity, kappa, record.air)
        start = np.maximum(start, LOWEST_START)
        gains, places = np.split(parameters[..., COMMON:], 2, axis=-1)
        places += record.strikes
        # No string pulls or pushes more: a step beyond gains nothing.
        middle, most = float(np.mean(ANY_ALPHA)), HUBER * ALPHA_SD
        gains = np.clip(gains, middle - most, max(middle, record.alpha) + most)
        return struck_trajectory(
            release, start, gravity, gains, record.ratios, places, kappa, record.air
        )

    def all_levels(self, role: str, x: Array) -> Array:
        """Return the height of the reference point at every expected edge of a side, m."""
        return np.asarray(self.expected[role].levels + x @ self.slopes[role].levels.T)

    def _matched_edges(self, role: str, match: Seen | Index) -> Seen:
        """Collect the matched edges; cached, as a matching lasts for many steps of a fit."""
        if isinstance(match, Seen):
            return match
        last, seen = self._seen.get(role, (None, None))
        if seen is None or last is not match:
            edges, (pick, edge) = self.records[role].edges, matched(match)
            seen = self.expected[role].seen(pick, edges.times[edge], edges.burst[edge])
            self._seen[role] = match, seen
        return seen

    def residuals(self, role: str, x: Array, match: Seen | Index) -> Residuals:
        """Return the residuals of one side's matched edges, of one drop or of many."""
        seen = self._matched_edges(role, match)
        times = seen.times * self.rate(x)
        path = self.trajectory(role, x)
        height, speed = path.heights(times)
        values = height - self.all_levels(role, x)[..., seen.pick]
        loose = np.where(seen.alone, 0.0, path.loose(times))
        return Residuals(values, self._sigma(seen, speed, loose), speed, seen.burst == 0.0, loose)

    def decorrelate(self, role: str, rows: Residuals, match: Index) -> Residuals:
        """Return residuals made independent: both edges of a rod share a departure."""
        rows = rows._replace(values=rows.values.copy(), sigma=rows.sigma.copy())
        self._part(self._matched_edges(role, match), rows.loose > 0.0, rows.values, rows.sigma)
        return rows

    def _part(self, seen: Seen, struck: Flags, values: Array, sigma: Array) -> Array:
        """Decorrelate both edges of a rod, in place; return `Equations.told`.

        They share a departure at a beam: the part of the second that the first predicts is
        subtracted (Cholesky of a 2 × 2 covariance).
        """
        together = seen.paired[:-1] & struck[..., :-1] & struck[..., 1:]
        first, scales = np.nonzero(together), self.components
        second, carried = _next(first, 1), np.zeros(values.shape)
        pair = seen.landed[first[-1]] * seen.landed[second[-1]]
        shared = scales.departure**2 + SHARED * (1.0 - SHARED) * scales.landed**2 * pair
        carried[second] = share = shared / sigma[first] ** 2
        values[second] -= share * values[first]
        sigma[second] = np.sqrt(sigma[second] ** 2 - share * shared)
        return carried

    def _sigma(self, seen: Seen, speed: Array, loose: Array) -> Array:
        """Return the standard deviation of each edge's height, m."""
        scales = self.components
        variance = scales.floor**2 + speed**2 * (scales.jitter**2 + seen.burst**2)
        variance += (1.0 - SHARED) * (scales.landed * seen.landed) ** 2
        sigma: Array = np.sqrt(variance + scales.departures(loose))
        return sigma

    def equations(self, role: str, x: Array, match: Seen | Index) -> Equations:
        """Return the observation equations of one side's matched edges, of one drop or of many.

        Derivatives are taken at the expected time of an edge, not at its stamp. Otherwise they
        would depend on the stamp's error, and bias the clock rate towards a slow clock.
        """
        acts, seen, rate = self.slopes[role], self._matched_edges(role, match), self.rate(x)
        stamped = self.residuals(role, x, match)
        late = np.zeros_like(stamped.values)
        near = (np.abs(stamped.values) <= STRAY * stamped.sigma) & (stamped.speed > 0.0)
        np.divide(stamped.values, stamped.speed, out=late, where=near)
        times, path = seen.times * rate + late, self.trajectory(role, x)
        height, speed, moved = path.sights(times, acts.moving, _strike_u(self, role))
        values = height - self.all_levels(role, x)[..., seen.pick] + speed * late
        sigma = self._sigma(seen, speed, stamped.loose)
        slopes = np.empty((*values.shape, acts.columns.size))
        slopes[:] = acts.sights.take(seen.pick, axis=0)
        slopes[..., : moved.shape[-1]] += moved
        # With a slow clock the true time is later, and the chain is lower.
        rates = self.unknowns.rate[acts.columns[acts.clocks]]
        slopes[..., acts.clocks] -= (speed * times / rate)[..., None] * rates
        carried = self._part(seen, stamped.loose > 0.0, values, sigma)
        second = np.nonzero(carried)
        slopes[second] -= carried[second][:, None] * slopes[_next(second, -1)]
        residuals = stamped._replace(values=values, sigma=sigma, speed=speed)
        return Equations(residuals, carried, slopes, acts.columns)


def _next(places: tuple[Index, ...], step: int) -> tuple[Index, ...]:
    """Return the places of the edges beside those at some places."""
    return *places[:-1], places[-1] + step


@lru_cache(maxsize=_RECENT)
def _path_at(model: DropModel, role: str, x: bytes, shape: tuple[int, ...]) -> Trajectory:
    return model._trajectory(role, np.frombuffer(x).reshape(shape))


@lru_cache(maxsize=_RECENT)
def _strike_u(model: DropModel, role: str) -> Array:
    """Return the uncertainty of each rod's strike height, see `Trajectory.sights`, m.

    At most a part of a rod's width, as no step leads further.
    """
    _, places = np.split(model.slopes[role].path[COMMON:], 2)
    sd = np.sqrt(places**2 @ model.unknowns.sd**2)
    return np.clip(_TOLD * sd, SHARPEST, min(model.records[role].chain.widths) / PART)


@lru_cache(maxsize=64)
def _model_of(protocol: Protocol, *blank: ChainRecord) -> DropModel:
    model = DropModel(protocol, blank, 0.0)
    # By content: whichever models are forgotten, drops of a condition stay together.
    model.condition = protocol, *(record.scene for record in blank)
    return model
