"""The current run: how to prepare it, the checklist, the countdown, and the fall."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from textual.containers import Horizontal, Vertical
from textual.content import Content
from textual.widgets import Digits

from rig.campaign.events import Stage
from rig.tui.motion import as_table, motions
from rig.tui.plots import chain_pictures
from rig.tui.scale import drawing
from rig.tui.screens.page import Page
from rig.tui.why import expected_words
from rig.tui.widgets.chains import ChainView
from rig.tui.widgets.figure import Figure
from rig.tui.widgets.gates import GateBoard, named
from rig.tui.widgets.text import Words, checked, duration, plain

if TYPE_CHECKING:
    from textual.app import ComposeResult

    from rig.records import Job
    from rig.tui.context import Options
    from rig.tui.model import Model
    from rig.tui.motion import ChainFall
    from rig.tui.scale import Drawing

_FALLING = (Stage.LIVE, Stage.JUDGING)
_WAITING = (Stage.SETTLING, Stage.ARMING, Stage.COUNTDOWN, Stage.FIRING)


class RunPage(Page):
    """Before and during one drop."""

    SCOPED_CSS = False
    DEFAULT_CSS = """
    RunPage #left { width: 1fr; }
    RunPage #right { width: 1fr; display: none; }
    RunPage.-live #right, .-normal RunPage #right, .-wide RunPage #right { display: block; }
    .-narrow RunPage.-live #left { display: none; }
    RunPage #checks { padding: 1 1; }
    RunPage Digits { height: 3; padding: 0 2; color: $warning; display: none; }
    RunPage.-count Digits { display: block; }
    RunPage #indicators { margin: 1 0 0 0; }
    .-low RunPage #checks { padding: 0 1; }
    """

    def __init__(self, options: Options) -> None:
        super().__init__(options)
        self._of: Job | None = None
        self._table = as_table(())  # its edges

    def compose(self) -> ComposeResult:
        with Horizontal():
            with Vertical(id="left"):
                yield Words(id="card")
                yield Digits("3", id="count")
                yield Words(id="checks")
                yield GateBoard(id="indicators")
            yield ChainView(id="chains")
            with Vertical(id="right"):
                yield Figure(id="z")
                yield Figure(id="dz")

    def show(self, model: Model) -> None:
        """Draw what holds now."""
        stage = model.stage
        self.set_class(stage in _FALLING, "-live")
        counting = stage is Stage.COUNTDOWN and model.driving
        self.set_class(counting, "-count")
        self.say("card", _card(model, self._expected(model), low=self.screen.has_class("-low")))
        if counting:
            self.query_one(Digits).update(f"{max(0.0, model.flow.left_s):.1f}")
        self.say("checks", _checks(model))
        self.query_one(GateBoard).show(model.protocol, model.indicators, model.now_s)
        self._plots(model)

    def _expected(self, model: Model) -> str:
        """Say what the model expects of the run in hand."""
        protocol, run = model.protocol, model.run
        if protocol is None or run is None:
            return ""
        return self.latest("model", (protocol, run), lambda: expected_words(protocol, run))

    def _plots(self, model: Model) -> None:
        protocol, run = model.protocol, model.run
        drop = model.state.section("drop")
        hz = float(drop.get("tick_hz") or 1e6)
        live = model.stage in _FALLING
        edges = model.state.edges if live else ()
        key = (protocol, model.job, run, len(edges), live)
        if model.job != self._of or len(edges) < len(self._table):
            self._of, self._table = model.job, as_table(())
        # Only what is new is taken over: there may be thousands, and they come every tick.
        self._table = np.concatenate([self._table, as_table(edges[len(self._table) :])])
        chains: Drawing | None = None
        falls: tuple[ChainFall, ...] = ()
        if protocol is not None and run is not None:
            falls = self.latest("falls", key, lambda: motions(protocol, run, self._table, hz))
            if live:  # where the latest edge has them
                time_s = float(self._table[-1, 0]) / hz if len(self._table) else 0.0
                chains = drawing(protocol, run, falls, model.indicators, time_s)
        self.query_one(ChainView).show(chains)
        self.draw(key, lambda: chain_pictures(falls))


def _card(model: Model, expected: str, *, low: bool) -> Content:
    """Say how to prepare the run; on a low screen in few lines."""
    run, job, protocol = model.run, model.job, model.protocol
    if model.loading:
        return Content(model.loading)
    if job is None or run is None or protocol is None:
        if model.state.runs and model.flow.stage is not Stage.PROTOCOL:
            return Content("All runs of the plan are complete.")
        return Content("No session is open. Choose an experiment first.")
    attempt = f" · attempt {job.attempt}" if job.attempt > 1 else ""
    head = Content.assemble((f"RUN {job.run} of {len(model.state.runs)}{attempt}", "bold $primary"))
    names = {"impact side": run.impact, "free side": run.free}
    facts = [(side, plain(name, 40)) for side, name in names.items() if name is not None]
    if not model.words.two_sides:
        facts = [(model.words.body.removeprefix("the "), facts[0][1])]
    if run.impact is not None:
        facts.append(("incline", f"{run.incline_deg:g}°"))
    expects = [("model", expected)] if expected else []
    start = ("drop", f"{protocol.drop.value * 1e3:.0f} mm {protocol.drop_from}")
    width, between = (0, "   ") if low else (12, "\n")
    setup = Content(between).join(_fact(*fact, width) for fact in facts)
    return Content("\n").join([head, setup, *(_fact(*fact, width) for fact in (start, *expects))])


def _fact(name: str, value: str, width: int) -> Content:
    return Content.assemble((f"{name:{width}} ", "$foreground 70%"), (value, "bold"))


def _checks(model: Model) -> Content:
    stage = model.stage
    rest = "hang still" if model.words.part == "rod" else "come to rest"
    if stage in _WAITING:
        words = {
            Stage.SETTLING: f"Waiting: let everything {rest} …",
            Stage.ARMING: "Arming …",
            Stage.COUNTDOWN: "ARMED. The release opens at zero."
            if model.driving
            else "ARMED by another client. Keep clear.",
            Stage.FIRING: "Releasing …",
        }
        keys = "\nAny key stops." if model.driving else ""
        return Content.assemble((words[stage], "bold $warning"), keys)
    if stage is Stage.LIVE:
        return Content.styled(f"FALLING  {len(model.state.edges)} edges so far", "bold $primary")
    if stage is Stage.JUDGING:
        return Content.styled("Reading and analysing the drop …", "bold $primary")
    if model.job is None or model.run is None:
        return Content("")
    indicators = model.indicators
    blocked, restless = indicators.blocked, indicators.restless(model.now_s)
    where = named(model, blocked[0]) if blocked else ""
    more = f" and {len(blocked) - 1} more" if len(blocked) > 1 else ""
    known, linked = indicators.known, model.connected and model.state.link == "up"
    no_beam = f"blocked: {where}{more}" if known else "waiting for the gates"
    moving = f"A beam keeps changing. Let everything {rest}."
    lines = [
        checked(linked, "device connected" if linked else "no device"),
        checked(known and not blocked, no_beam if blocked or not known else "every beam clear"),
        checked(known and not restless, moving if restless or not known else "gates steady"),
        Content.assemble(("○ ", "bold"), "set up as above, at rest, hands away"),
    ]
    settle = duration(model.settle_s)
    end = (
        f"\nEnter arms: {settle} of rest, 3 s of countdown, release."
        if model.driving
        else "\nWatching. Press c to take control when it is free."
    )
    return Content.assemble(Content("\n").join(lines), end)
