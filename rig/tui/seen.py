"""What the screens are about now: put together from daemon, session file and flow."""

from __future__ import annotations

from time import monotonic
from typing import TYPE_CHECKING

from rig.campaign.events import Stage
from rig.campaign.plan import again, rest_s
from rig.campaign.plan import next_job as next_of
from rig.records import Job
from rig.tui.model import Model

if TYPE_CHECKING:
    from rig.campaign.plan import RunLine
    from rig.tui.app import RigApp

_BETWEEN = (Stage.PREPARE, Stage.DEVICE, Stage.TESTING, Stage.DONE)


def model(app: RigApp) -> Model:
    """Take everything that is drawn, as it is now."""
    client, follower = app.client, app.follower
    view = follower.view
    return Model(
        state=follower.state,
        flow=app.flow,
        indicators=follower.indicators,
        protocol=view.protocol if view else None,
        view=view,
        voids=follower.voids,
        connected=client is None or client.up,
        driving=app.driving,
        job=job(app),
        now_s=monotonic(),
        silence=client.silence if client else "",
        settle_s=settle_s(app),
        port=client.port if client else "",
        offline=client is None,
        unreadable=follower.unreadable,
        read=follower.done,
    )


def runs(app: RigApp) -> tuple[RunLine, ...]:
    """Return the plan as it stands, our own latest verdict in it."""
    flow = app.flow
    if flow.stage is not Stage.RESULT or flow.job is None:
        return app.state.runs
    mine = flow.job
    return tuple(
        line._replace(state=flow.verdict, attempt=mine.attempt) if line.run == mine.run else line
        for line in app.state.runs
    )


def next_job(app: RigApp) -> Job | None:
    """Name the attempt that comes next; `None` when the plan is done."""
    lines, flow = runs(app), app.flow
    if flow.stage is Stage.PREPARE and flow.job is not None:
        return again(lines, flow.job.run)
    return next_of(lines, app.follower.voids.counts(lines))


def job(app: RigApp) -> Job | None:
    """Name the attempt that the screens are about."""
    view = app.view
    latest = view.jobs[-1] if view and view.jobs else None
    if app.client is None:
        return latest
    drop = app.state.section("drop")
    if drop and not app.driving:
        return Job(drop["run"], drop["attempt"])
    if app.flow.stage in _BETWEEN:
        return latest if app.page == "result" and latest else next_job(app)
    return app.flow.job


def settle_s(app: RigApp) -> float:
    """Say how long the chains rest before the next drop."""
    if app.view is None:
        return 0.0
    clock = app.view.clock.device
    return rest_s(app.view.protocol.plan.settle, clock.u if clock else None)
