"""The ``release``, ``plan`` and ``accept`` of a protocol."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, cast

from rig.boards import RELEASES
from rig.protocol import fields
from rig.protocol.fields import Range, Section
from rig.protocol.protocol import Accept, Order, Plan, ReleasePulse
from rig.protocol.yamltree import ScalarNode
from rig.units import Dimension

if TYPE_CHECKING:
    from rig.protocol.fields import Converter, FieldFaults
    from rig.protocol.yamltree import Node

# A coil that is held longer than this burns; one pulsed shorter does not pull.
PULSE = Range(Dimension.TIME, 0.001, 2.0, "ms")
INCLINE = Range(Dimension.ANGLE, 0.0, 90.0, "deg")
SETTLE = Range(Dimension.TIME, 0.0, 3600.0, "s")
MOST_REPEATS = 10_000
MOST_RUNS = 100_000
LARGEST_SEED = 2**63 - 1
RELEASE_SKEW = Range(Dimension.TIME, 0.0, 10.0, "ms", open_low=True)
SHARE_OF_EDGES = Range(Dimension.NUMBER, 0.0, 1.0, "%")


def read_settings(
    top: Section, *, turns: bool
) -> tuple[ReleasePulse | None, Plan | None, Accept | None]:
    """Read all three from the root of a protocol; `None` for what is faulty.

    Without a surface there is nothing to incline; `turns` says whether an order may be given in
    which chains take turns.
    """
    plan = _plan(surface="surface" in top, turns=turns)
    return (
        top.take("release", _release, ReleasePulse()),
        top.take("plan", plan, Plan()),
        top.take("accept", _accept, Accept()),
    )


@fields.of_keys("channel", "pulse")
def _release(section: Section) -> ReleasePulse | None:
    """Convert to the release actuator."""
    usual = ReleasePulse()
    channel = section.take("channel", fields.whole(0, RELEASES - 1), usual.channel)
    pulse = section.take("pulse", fields.exact(PULSE), usual.pulse)
    return None if channel is None or pulse is None else ReleasePulse(channel, pulse)


_ACCEPT = {
    "release_skew": RELEASE_SKEW,
    "missed_edges": SHARE_OF_EDGES,
    "unexplained_edges": SHARE_OF_EDGES,
}


@fields.of_keys(*_ACCEPT)
def _accept(section: Section) -> Accept | None:
    """Convert to the limits of a valid run."""
    usual = Accept()
    limits = {
        name: section.take(name, fields.exact(accepted), getattr(usual, name))
        for name, accepted in _ACCEPT.items()
    }
    sound = {name: limit for name, limit in limits.items() if limit is not None}
    return Accept(**sound) if len(sound) == len(_ACCEPT) else None


def _plan(*, surface: bool, turns: bool) -> Converter[Plan]:
    """Return the converter to the plan."""

    @fields.of_keys("incline", "repeats", "order", "randomize", "seed", "settle")
    def convert(section: Section) -> Plan | None:
        if "incline" in section and not surface:
            message = "the scene has no surface; leave incline out"
            section.fault("incline", message, at_key=True)
        usual = Plan()
        inclines = section.take("incline", _inclines, usual.inclines)
        repeats = section.take("repeats", fields.whole(1, MOST_REPEATS), usual.repeats)
        order = section.take("order", fields.choice("ABBA", "alternate", "fixed"), usual.order)
        if "order" in section and order in {"ABBA", "alternate"} and not turns:
            message = f"found {order}, which needs two chains; leave order out"
            section.fault("order", message)
        mixed = fields.choice("none", "incline", "all")
        randomize = section.take("randomize", mixed, usual.randomize)
        seed = section.take("seed", fields.whole(0, LARGEST_SEED), usual.seed)
        settle = section.take("settle", fields.exact(SETTLE), usual.settle)
        if inclines is None or repeats is None or order is None:
            return None
        if randomize is None or seed is None or settle is None:
            return None
        if len(inclines) * repeats > MOST_RUNS:
            message = f"found {len(inclines) * repeats} runs; at most {MOST_RUNS} are accepted"
            section.fault("repeats", message)
            return None
        return Plan(
            inclines=inclines,
            repeats=repeats,
            order=cast("Order", order),
            randomize=cast('Literal["none", "incline", "all"]', randomize),
            seed=seed,
            settle=settle,
        )

    return convert


def _inclines(node: Node, key: str, faults: FieldFaults) -> tuple[float, ...] | None:
    """Convert one angle or a list of different angles, degrees."""
    convert = fields.exact(INCLINE)
    if isinstance(node, ScalarNode):
        angle = convert(node, key, faults)
        return None if angle is None else (angle,)
    listed = fields.sequence(node, key, faults)
    if listed is None:
        return None
    lines: dict[float, int] = {}
    for i, item in enumerate(listed.items):
        angle = convert(item, f"{key}[{i}]", faults)
        if angle in lines:
            message = f"found {item} again (line {lines[angle]}); use repeats for more drops"
            faults.add(item.place, f"{key}[{i}]", message)
        elif angle is not None:
            lines[angle] = item.place.line
    return tuple(lines) if len(lines) == len(listed.items) else None
