"""What the operator looks at: which drop, which moment, which row, which part of a page."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from textual.content import Content

from rig.tui.replay import Player, end_of
from rig.tui.survey import HERE, first_row, read_file

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from rig.records import Job
    from rig.results.live import SessionView
    from rig.tui.context import Options
    from rig.tui.model import Model
    from rig.tui.plotting import Picture
    from rig.tui.scale import Drawing
    from rig.tui.survey import Beginning, ProtocolFile

T = TypeVar("T")
REPLAY_S = 6.0
"""How long the slow motion after a fall lasts."""


class Face(NamedTuple):
    """What a page shows, as data.

    Attributes
    ----------
    head, foot
        Above and below all else.
    drawing
        The rig to scale.
    pictures
        Plots, the most wanted first; `beside` of them at once on a screen of 120 columns.
    moment
        Where a drop that is played stands, s; `None` for none.
    words
        Tables. Where there is no room for drawing, plots and tables, Tab turns to the others.
    digits
        Large digits over the drawing.
    menu
        A list to choose from, left of all else.
    top
        Whether words come before the drawing.
    """

    head: Content
    drawing: Drawing | None = None
    pictures: Sequence[Picture] = ()
    moment: float | None = None
    words: Content = Content("")
    foot: Content = Content("")
    digits: str = ""
    beside: int = 1
    menu: Content = Content("")
    top: bool = False


class Desk:
    """What is looked at.

    Attributes
    ----------
    players
        How the drop of each page is played.
    other
        Another session than the one in hand, on the history page.
    opens_first
        Whether Enter was pressed before there was a list.
    replayed
        The latest drop whose slow motion was begun.
    chart, part, row
        How often another plot, and another part of the page, was asked for; the row of a list.
    """

    def __init__(self, options: Options) -> None:
        self.options = options
        self.players: defaultdict[str, Player] = defaultdict(Player)
        self.other: SessionView | None = None
        self.chart = self.part = 0
        self.row = -1  # none yet
        self.opens_first = False
        self.rows: list[Beginning] = []
        self.opened: Path | None = None  # the protocol that was opened here last
        self.replayed: Job | None = None
        self._latest: dict[str, tuple[object, Any]] = {}

    def latest(self, name: str, key: object, work: Callable[[], T]) -> T:
        """Return what `work` gives, worked out anew only where `key` differs from the last time.

        Pages are drawn many times a second, and what they show may take long.
        """
        if name not in self._latest or self._latest[name][0] != key:
            self._latest[name] = key, work()
        value: T = self._latest[name][1]
        return value

    @property
    def chosen(self) -> Beginning | None:
        """The row of the home page that Enter takes."""
        return self.rows[self.row % len(self.rows)] if self.rows else None

    def reading(self, file: Path) -> ProtocolFile:
        """A protocol, read again when it changed: it may be open in an editor beside this."""
        try:
            changed_ns = file.stat().st_mtime_ns
        except OSError:
            changed_ns = -1
        return self.latest("reading", (file, changed_ns), lambda: read_file(file))

    def begin_with(self, rows: list[Beginning]) -> None:
        """List what can be begun; choose an experiment that is new here, or as before."""
        before, known, self.rows = self.chosen, self.rows, rows
        new = [row for row in rows if row.section == HERE and known and row not in known]
        chosen = new[0] if new else before
        self.row = rows.index(chosen) if chosen in rows else first_row(rows, self.options)

    def view(self, model: Model) -> SessionView | None:
        """The session of the history page; `None` without a drop."""
        view = self.other or model.view
        return view if view and view.jobs else None

    def job(self, model: Model) -> Job | None:
        """The drop of the history page."""
        view = self.view(model)
        return view.jobs[self.players["history"].at % len(view.jobs)] if view else None

    def drop(self, model: Model) -> tuple[SessionView | None, Job | None]:
        """The drop of the page that is shown, where it was analysed."""
        if model.page == "history":
            return self.view(model), self.job(model)
        view, job = model.view, model.job
        return (view, job) if view is not None and job in view.results else (None, None)

    def change(self, model: Model, change: Callable[[Player, float], Player]) -> None:
        """Change how the drop of the page is played, knowing when it ends (s)."""
        view, job = self.drop(model)
        end_s = end_of(view.drops[job], view.scales[job].hz) if view and job else 0.0
        self.players[model.page] = change(self.players[model.page], end_s)

    def tick(self, model: Model, seconds: float) -> None:
        """Let time pass, and begin the slow motion of a drop that has just been analysed."""
        _, job = self.drop(model)
        fresh = model.page == "result" and job == model.flow.job and not model.blind
        if fresh and job not in {None, self.replayed}:
            self.replayed = job
            self.change(model, lambda _, end_s: Player(speed=end_s / REPLAY_S, playing=True))
        if self.players[model.page].playing:
            self.change(model, lambda player, end_s: player.ticked(seconds, end_s))

    def choose(self, model: Model, at: int) -> None:
        """Take one drop of the list, from its beginning."""
        view = self.view(model)
        tape, count = self.players["history"], len(view.jobs) if view else 0
        self.players["history"] = tape.other(at - tape.at, count)
