"""Checks of a bad line: repeats, frames without a seq, junk."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

from rig.link import messages as wire
from rig.link.frames import DELIMITER
from rig.link.messages import Phase
from rig.selftest.verdicts import CheckFailedError

if TYPE_CHECKING:
    from rig.selftest.stage import Stage

_QUIET_S = 0.05
_BURSTS = 20


def repeats(stage: Stage) -> str:
    """See that a repeated request is answered as before and not executed again."""
    order = stage.order()
    seq = stage.next_seq()
    armed = stage.ask(order, seq)
    token = stage.armed_by(armed)
    if stage.ask(order, seq) != armed:
        raise CheckFailedError("a repeated ARM armed it again")
    seq = stage.next_seq()
    fired = stage.ask(wire.Fire(token), seq)
    if not isinstance(fired, wire.Fired) or stage.ask(wire.Fire(token), seq) != fired:
        raise CheckFailedError("a repeated FIRE is not answered as before")
    recorded = stage.ending(fired, order.record_ms)
    if recorded.certificate.fire_tick != fired.tick:
        raise CheckFailedError("a repeated FIRE fired again")
    seq = stage.next_seq()
    done = wire.Acknowledge(recorded.certificate.label, recorded.certificate.crc32)
    if [stage.ask(done, seq), stage.ask(done, seq)] != [wire.Done()] * 2:
        raise CheckFailedError("a repeated ACKNOWLEDGE is not answered as before")
    return ""


def without_seq(stage: Stage) -> str:
    """See that a frame without a seq is passed over."""
    stage.line.say(wire.Status(), 0)
    heard = stage.wait(_QUIET_S, lambda h: isinstance(h.message, wire.State))
    if heard is not None:
        raise CheckFailedError("it answers a request that has no seq")
    return ""


def junk(stage: Stage) -> str:
    """See that junk on the line disturbs nothing."""
    noise = random.Random(3)  # noqa: S311 - noise, not secrets
    for _ in range(_BURSTS):
        stage.line.port.write(noise.randbytes(noise.randrange(1, 300)) + DELIMITER)
        if stage.phase() is not Phase.IDLE:
            raise CheckFailedError("junk made it do something")
    return f"{_BURSTS} bursts"
