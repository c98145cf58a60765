"""Asynchronous driver of a campaign, which carries out effects in the background."""

from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from time import monotonic
from typing import Any

from rig.campaign import machine as campaign
from rig.campaign.machine import Effect, Event, effect_failure, step
from rig.errors import DeviceTimeoutError, RigError
from rig.tui.follow import Follower
from rig.tui.model import Model, StopAnswer


@dataclass
class Driver:
    """Handles events of a campaign in order.

    Parameters
    ----------
    model
        Where the state of the campaign is, and the client that carries out effects.
    follower
        Reader of the session.
    begin
        Runs a coroutine in the background.

    Attributes
    ----------
    asked
        Protocol and session that were opened from here; `None` after they were closed.
    """

    model: Model
    follower: Follower
    begin: Callable[[Coroutine[Any, Any, None]], object]
    asked: tuple[str, str] | None = None

    def take(self, event: Event) -> None:
        """Handle an event, and carry out its effects."""
        model = self.model
        model.flow, effects = step(model.flow, event)
        for effect in effects:
            if isinstance(effect, campaign.Stop) and model.client.idle:
                continue  # without a rig, no chain can fall
            if isinstance(effect, campaign.Stop):
                model.stop = StopAnswer(monotonic())
            self.begin(self._carry_out(effect, model.flow.ticket))

    async def open_session(self, protocol: str, session: str, seed: int | None) -> None:
        """Open a session in the daemon, now and after each restart."""
        names = {"protocol": protocol, "session": session, "seed": seed}
        try:
            await self.model.client.connection.call("open_session", **names)
        except RigError:
            self.asked = None
            self.take(campaign.SessionClose())
            raise
        self.asked = protocol, session

    async def close_session(self) -> None:
        """Close the session, so that another can be chosen."""
        self.asked = None
        await self.model.client.connection.call("close_session")

    async def _carry_out(self, effect: Effect, ticket: int) -> None:
        """Carry out an effect, and handle the resulting event."""
        client, token = self.model.client, None
        try:
            match effect:
                case campaign.GiveUp():
                    return  # the error is shown, and the operator decides
                case campaign.Stop(reason):
                    await self._switch_off(reason)
                    return
                case campaign.Wait(seconds):
                    await client.connection.call("wait", seconds=seconds)
                case campaign.ArmRelease(job):
                    answer = await client.connection.call("arm", **job._asdict())
                    token = int(answer["token"])
                case campaign.FireRelease(armed):
                    await client.connection.call("fire", token=armed)
                case campaign.Drive():
                    await client.connection.call("test_release")
                case campaign.Collect(job):
                    await client.connection.call("collect", **job._asdict())
                case campaign.Log(job, state, reasons):
                    verdict = {"state": state, "reasons": [reason.record() for reason in reasons]}
                    await client.connection.call("log_state", **job._asdict(), **verdict)
                case campaign.Judge(job):
                    result = (await self.follower.read()).results[job]
                    row = self.model.voids.row
                    self.take(campaign.DropVerdict(ticket, result.verdict, result.reasons, row))
                    return
        except RigError as error:
            self.take(effect_failure(ticket, error))
        else:
            self.take(campaign.EffectDone(ticket, token))

    async def _switch_off(self, reason: str) -> None:
        """Switch all outputs off, and repeat until the result is known.

        The daemon answers within a second, even without an answer of the board.
        """
        model, is_known = self.model, False
        asked = model.stop
        while not is_known and asked is model.stop:
            try:
                await model.client.connection.call("stop", reason=reason)
            except RigError as error:
                heard, is_known = False, not isinstance(error, DeviceTimeoutError)
            else:
                heard = is_known = True
            if asked is not None and asked is model.stop:
                asked = model.stop = asked._replace(heard=heard)
