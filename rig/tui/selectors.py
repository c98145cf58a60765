"""What the screens are about now: selected from what is known of daemon, session and campaign."""

from __future__ import annotations

from dataclasses import replace
from time import monotonic
from typing import TYPE_CHECKING

from rig.analysis.result import GOOD
from rig.campaign import plan
from rig.campaign.events import Stage
from rig.records import Job
from rig.tui.model import Model

if TYPE_CHECKING:
    from rig.campaign.machine import Flow
    from rig.campaign.plan import RunLine
    from rig.tui.client import ReconnectingClient
    from rig.tui.follow import Follower
    from rig.tui.model import StopAnswer

_BETWEEN = (Stage.PREPARE, Stage.DEVICE, Stage.TESTING, Stage.DONE)


def model(
    client: ReconnectingClient | None,
    follower: Follower,
    flow: Flow,
    stop: StopAnswer | None,
    page: str,
) -> Model:
    """Take everything that is drawn, as it is now."""
    view = follower.view
    found = Model(
        state=follower.state,
        flow=flow,
        stop=stop,
        disk_s=client.disk_s if client else 0.0,
        indicators=follower.indicators,
        protocol=view.protocol if view else None,
        view=view,
        voids=follower.voids,
        connected=client is None or client.up,
        driving=client is not None and client.driving,
        now_s=monotonic(),
        silence=client.silence if client else "",
        port=client.port if client else "",
        offline=client is None,
        unreadable=follower.unreadable,
        read=follower.done,
    )
    return replace(found, job=job(found, page), settle_s=settle_s(found))


def runs(model: Model) -> tuple[RunLine, ...]:
    """Return the plan as it stands, our own latest verdict in it."""
    flow = model.flow
    if flow.stage is not Stage.RESULT or flow.job is None:
        return model.state.runs
    mine = flow.job
    return tuple(
        line._replace(state=flow.verdict, attempt=mine.attempt) if line.run == mine.run else line
        for line in model.state.runs
    )


def next_job(model: Model) -> Job | None:
    """Name the attempt that comes next; `None` when the plan is done."""
    lines, flow = runs(model), model.flow
    if flow.stage is Stage.PREPARE and flow.job is not None:
        return plan.again(lines, flow.job.run)
    return plan.next_job(lines, model.voids.counts(lines))


def job(model: Model, page: str) -> Job | None:
    """Name the attempt that a page is about."""
    latest = model.view.jobs[-1] if model.view and model.view.jobs else None
    if model.offline:
        return latest
    drop = model.state.section("drop")
    if drop and not model.driving:
        return Job(drop["run"], drop["attempt"])
    if model.flow.stage in _BETWEEN:
        return latest if page == "result" and latest else next_job(model)
    return model.flow.job


def good(model: Model, run: int) -> bool:
    """Whether a run has a drop that counts."""
    return any(line.run == run and line.state in GOOD for line in runs(model))


def settle_s(model: Model) -> float:
    """Say how long the chains rest before the next drop."""
    if model.view is None:
        return 0.0
    clock = model.view.clock.device
    return plan.rest_s(model.view.protocol.plan.settle, clock.u if clock else None)
