"""Checks of a bad line: repeats, frames without a seq, junk."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

from rig.link import messages as wire
from rig.link.frames import DELIMITER
from rig.link.messages import Phase
from rig.selftest.verdicts import CheckFailedError

if TYPE_CHECKING:
    from rig.selftest.board import BoardUnderTest

_QUIET_S = 0.05
_BURSTS = 20


def repeats(board: BoardUnderTest) -> str:
    """See that a repeated request is answered as before and not executed again."""
    order = board.order()
    seq = board.next_seq()
    armed = board.ask(order, seq)
    token = board.armed_by(armed)
    if board.ask(order, seq) != armed:
        raise CheckFailedError("a repeated ARM armed it again")
    seq = board.next_seq()
    fired = board.ask(wire.Fire(token), seq)
    if not isinstance(fired, wire.Fired) or board.ask(wire.Fire(token), seq) != fired:
        raise CheckFailedError("a repeated FIRE is not answered as before")
    recorded = board.ending(fired, order.record_ms)
    if recorded.certificate.fire_tick != fired.tick:
        raise CheckFailedError("a repeated FIRE fired again")
    seq = board.next_seq()
    done = wire.Acknowledge(recorded.certificate.label, recorded.certificate.crc32)
    if [board.ask(done, seq), board.ask(done, seq)] != [wire.Done()] * 2:
        raise CheckFailedError("a repeated ACKNOWLEDGE is not answered as before")
    return ""


def without_seq(board: BoardUnderTest) -> str:
    """See that a frame without a seq is passed over."""
    board.line.say(wire.Status(), 0)
    heard = board.wait(_QUIET_S, lambda h: isinstance(h.message, wire.State))
    if heard is not None:
        raise CheckFailedError("it answers a request that has no seq")
    return ""


def junk(board: BoardUnderTest) -> str:
    """See that junk on the line disturbs nothing."""
    noise = random.Random(3)  # noqa: S311 - noise, not secrets
    for _ in range(_BURSTS):
        board.line.port.write(noise.randbytes(noise.randrange(1, 300)) + DELIMITER)
        if board.phase() is not Phase.IDLE:
            raise CheckFailedError("junk made it do something")
    return f"{_BURSTS} bursts"
