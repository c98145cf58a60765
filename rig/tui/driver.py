"""The asynchronous driver of a campaign: has effects carried out beside the screens."""

from __future__ import annotations

from time import monotonic
from typing import TYPE_CHECKING, Any

from rig.campaign import machine as campaign
from rig.campaign.machine import Stage, effect_failure, step
from rig.errors import DeviceTimeoutError, RigError
from rig.tui.model import StopAnswer

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from rig.campaign.machine import Effect, Event, Flow
    from rig.tui.client import ReconnectingClient
    from rig.tui.follow import Follower


class Driver:
    """Takes what happens, one event after the other.

    Parameters
    ----------
    flow
        Where the campaign is at first.
    client
        What carries effects out; `None` where a file is only looked at.
    follower
        What reads and analyses the session.
    begin
        Runs a coroutine beside the screens.

    Attributes
    ----------
    flow
        Where the campaign is.
    stop
        What became of the latest STOP; `None` before the first.
    asked
        Protocol and session that were opened from here; `None` when they were closed.
    """

    def __init__(
        self,
        flow: Flow,
        client: ReconnectingClient | None,
        follower: Follower,
        begin: Callable[[Coroutine[Any, Any, None]], object],
    ) -> None:
        self.flow = flow
        self.stop: StopAnswer | None = None
        self.asked: tuple[str, str] | None = None
        self._client = client
        self._follower = follower
        self._begin = begin

    def take(self, event: Event) -> None:
        """Take an event, and have its effects carried out."""
        self.flow, effects = step(self.flow, event)
        if self.flow.stage is Stage.RESULT and self.flow.job is not None:
            self._follower.judged.add(self.flow.job)
        for effect in effects:
            if isinstance(effect, campaign.Stop) and (self._client is None or self._client.idle):
                continue  # nothing is there that could fall
            if isinstance(effect, campaign.Stop):
                self.stop = StopAnswer(monotonic())
            self._begin(self._carry_out(effect, self.flow.ticket))

    def refuse(self, error: RigError) -> None:
        """Say what is wrong and what to do."""
        self.take(effect_failure(self.flow.ticket, error))

    async def open_session(self, protocol: str, session: str, seed: int | None) -> None:
        """Have the daemon open a session, now and whenever it had to be started again."""
        assert self._client is not None
        try:
            await self._client.call("open_session", protocol=protocol, session=session, seed=seed)
        except RigError as error:
            self.refuse(error)
        else:
            self.asked = protocol, session

    async def _carry_out(self, effect: Effect, ticket: int) -> None:
        """Do what is wanted, and take what came of it."""
        client = self._client
        assert client is not None
        token = None
        try:
            match effect:
                case campaign.GiveUp():
                    return  # what is wrong is shown, and the operator goes on from there
                case campaign.Stop(reason):
                    await self._switch_off(client, reason)
                    return
                case campaign.Wait(seconds):
                    await client.call("wait", seconds=seconds)
                case campaign.ArmRelease(job):
                    answer = await client.call("arm", run=job.run, attempt=job.attempt)
                    token = int(answer["token"])
                case campaign.FireRelease(armed):
                    await client.call("fire", token=armed)
                case campaign.Drive():
                    await client.call("test_release")
                case campaign.Collect(job):
                    await client.call("collect", run=job.run, attempt=job.attempt)
                case campaign.Log(job, state, reasons):
                    await client.call(
                        "log_state", run=job.run, attempt=job.attempt, state=state,
                        reasons=[reason.record() for reason in reasons],
                    )  # fmt: skip
                case campaign.Judge(job):
                    result = (await self._follower.read()).results[job]
                    row = self._follower.voids.row
                    self.take(campaign.DropVerdict(ticket, result.verdict, result.reasons, row))
                    return
        except RigError as error:
            self.take(effect_failure(ticket, error))
        else:
            self.take(campaign.EffectDone(ticket, token))

    async def _switch_off(self, client: ReconnectingClient, reason: str) -> None:
        """Have everything switched off, and ask on until it is known whether it is.

        The daemon answers after a second at the latest, also when the board was not heard by then.
        """
        asked, is_known = self.stop, False
        while not is_known and asked is self.stop:
            try:
                await client.call("stop", reason=reason)
            except RigError as error:
                heard, is_known = False, not isinstance(error, DeviceTimeoutError)
            else:
                heard = is_known = True
            if asked is not None and asked is self.stop:
                asked = self.stop = asked._replace(heard=heard)
