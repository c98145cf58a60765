"""Random moments at which something happens to a session, and what they fell upon."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rig.link.messages import Phase
from rig.protocol.measurable import LEAST_RECORD_MS
from rig.session.schema import RunState
from rig.session.store import Session

if TYPE_CHECKING:
    import random
    from collections.abc import Sequence

    from bench.process_fixture import ProcessFixture, Seen

STATES = ("idle", "armed", "firing", "falling", "collecting", "stored", "judging")
"""What a moment can fall upon: nothing armed (settling, connecting, opening); armed; fired in the
session's log and not yet on the board; falling; held by the board and not in the file (being read,
or committed); in the file and not forgotten by the board; recorded and not judged."""

_RECORD_S = LEAST_RECORD_MS / 1000
# How often to aim at what, the phase to wait for, and how long after its beginning to strike. Left
# to chance alone, nearly all moments fall upon a rig that settles or a chain that falls.
_AIMS: tuple[tuple[float, Phase | None, float, float], ...] = (
    (0.25, None, 0.0, 4.0),
    (0.30, Phase.ARMED, 0.0, 0.01),
    (0.15, Phase.RECORDING, 0.0, _RECORD_S),
    (0.30, Phase.RECORDING, _RECORD_S - 0.002, _RECORD_S + 0.025),
)
_LOOK_S = 0.0005
_AGAIN_S = 0.1  # until a runner that found the link down is started again


def reach(processes: ProcessFixture, chance: random.Random, accept: Sequence[int] = (0, 4)) -> bool:
    """Let the runner run until a random moment.

    Parameters
    ----------
    processes
        With a runner.
    chance
        Chooses the moment.
    accept
        Exit codes after which it is started again, but for 0: then the session is finished.

    Returns
    -------
    bool
        Whether the moment came; `False` when the session was finished before.
    """
    _, phase, first, last = chance.choices(_AIMS, [aim[0] for aim in _AIMS])[0]
    delay = chance.uniform(first, last)
    until = time.monotonic() + delay if phase is None else None
    processes.follow()  # what was before does not count
    while until is None or time.monotonic() < until:
        assert processes.runner is not None
        if processes.runner.poll() is not None:
            code = processes.waited()
            if code == 0:
                return False
            if code not in accept:
                raise AssertionError(processes.told)
            time.sleep(_AGAIN_S)
            processes.start_runner()
        if until is None:
            begun = [seen["at_s"] for seen in processes.follow() if seen.get("phase") == phase]
            until = begun[0] + delay if begun else None
        time.sleep(_LOOK_S)
    return True


def fell_upon(processes: ProcessFixture, at_s: float) -> str:
    """Say which of `STATES` a moment fell upon."""
    phase, state = Phase.IDLE, None
    for seen in processes.happened():
        if "phase" in seen and seen["at_s"] <= at_s:
            phase = Phase(seen["phase"])
    if processes.session.exists():
        with Session.open(processes.session, readonly=True) as session:
            for entry in session.states():
                if entry.host_ns <= at_s * 1e9:
                    state = entry.state
    if phase is Phase.ARMED:
        return "firing" if state is RunState.FIRED else "armed"
    if phase is Phase.RECORDING:
        return "falling"
    if phase is Phase.HOLDING:
        return "collecting" if state is RunState.FIRED else "stored"
    return "judging" if state is RunState.RECORDED else "idle"


def off_after(happened: Sequence[Seen], at_s: float) -> float:
    """How long after a moment something was armed or on for certain, s; 0 when nothing was.

    What was armed may be let go all the same (FIRE was on its way, or a full disk had room for one
    more line): then it counts from there to the end of its pulse.
    """
    armed = on = False
    for seen in happened:
        if "phase" not in seen:
            continue
        if seen["at_s"] > at_s:
            if not (armed or on):
                return 0.0
            if armed and seen["phase"] == Phase.RECORDING:
                at_s = seen["at_s"]
            elif seen["phase"] != Phase.ARMED and not seen["outputs"]:
                # The change was not before, and what the board heard last it may have heard late.
                return max(0.0, float(seen["after_s"] - seen["gap_s"] - at_s))
        armed, on = seen["phase"] == Phase.ARMED, bool(seen["outputs"])
    return 0.0
