"""The operator's view: drop, moment, row, and part of a page."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from textual.content import Content

from rig.files import file_stamp
from rig.records import Job
from rig.tui.beginnings import HERE, Beginning, ProtocolFile, first_row, read_file
from rig.tui.context import Options
from rig.tui.model import Model
from rig.tui.replay import Player, end_of

if TYPE_CHECKING:
    from rig.results.live import SessionView
    from rig.tui.plotting import Picture
    from rig.tui.scale import Drawing

T = TypeVar("T")
REPLAY_S = 6.0
"""Duration of the slow motion after a fall, s."""


class Face(NamedTuple):
    """Content of a page, as data.

    Attributes
    ----------
    head, foot
        Text above and below all other parts.
    drawing
        The rig to scale.
    pictures
        Plots, the most important first; `beside` of them at once on a screen of 120 columns.
    moment
        Time of the replayed drop, s; `None` without a replay.
    words
        Tables. If there is no room for drawing, plots and tables, Tab switches between them.
    digits
        Large digits over the drawing.
    menu
        A list to choose from, left of all other parts.
    top
        Whether words come before the drawing.
    """

    head: Content = Content("")
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
    """State of the operator's view.

    Attributes
    ----------
    players
        Replay state of each page's drop.
    other
        Another session than the open one, on the history page.
    opens_first
        Whether Enter was pressed before the list was ready.
    replayed
        The latest drop whose slow motion was started.
    chart, part, row
        Number of switches of plot and of page part so far; the row of a list.
    width
        Columns of the tables.
    """

    def __init__(self, options: Options) -> None:
        self.options = options
        self.players: defaultdict[str, Player] = defaultdict(Player)
        self.other: SessionView | None = None
        self.chart = self.part = 0
        self.row = -1  # no row yet
        self.width = 0
        self.opens_first = False
        self.rows: list[Beginning] = []
        self.opened: Path | None = None  # last protocol opened here
        self.replayed: Job | None = None
        self._latest: dict[str, tuple[object, Any]] = {}

    def latest(self, name: str, key: object, work: Callable[[], T]) -> T:
        """Return the result of `work`, computed again only if `key` has changed.

        Pages are drawn many times a second, and their content may be slow to compute.
        """
        if name not in self._latest or self._latest[name][0] != key:
            self._latest[name] = key, work()
        value: T = self._latest[name][1]
        return value

    @property
    def chosen(self) -> Beginning | None:
        """Selected row of the home page."""
        return self.rows[self.row % len(self.rows)] if self.rows else None

    def reading(self, file: Path) -> ProtocolFile:
        """Return a protocol, read again if the file has changed, for example in an editor."""
        return self.latest("reading", (file, file_stamp(file)), lambda: read_file(file))

    def begin_with(self, rows: list[Beginning]) -> None:
        """Set the rows of the home page; select a new experiment, or keep the selection."""
        before, known, self.rows = self.chosen, self.rows, rows
        new = [row for row in rows if row.section == HERE and known and row not in known]
        chosen = new[0] if new else before
        self.row = rows.index(chosen) if chosen in rows else first_row(rows, self.options)

    def view(self, model: Model) -> SessionView | None:
        """Return the session of the history page; `None` without a drop."""
        view = self.other or model.view
        return view if view and view.jobs else None

    def drop(self, model: Model) -> tuple[SessionView | None, Job | None]:
        """Return the drop of the shown page, once analysed."""
        view, job = model.view, model.job
        if model.page == "history":
            view = self.view(model)
            job = view.jobs[self.players["history"].at % len(view.jobs)] if view else None
        return (view, job) if view is not None and job in view.results else (None, None)

    def change(self, model: Model, change: Callable[[Player, float], Player]) -> None:
        """Change the replay of the page's drop by a function of the player and its end time (s)."""
        view, job = self.drop(model)
        end_s = end_of(view.drops[job], view.scales[job].hz) if view and job else 0.0
        self.players[model.page] = change(self.players[model.page], end_s)

    def tick(self, model: Model, seconds: float) -> None:
        """Advance the replay, and start the slow motion of a newly analysed drop."""
        _, job = self.drop(model)
        fresh = model.page == "result" and job == model.flow.job and not model.blind
        if fresh and job not in {None, self.replayed}:
            self.replayed = job
            self.change(model, lambda _, end_s: Player(speed=end_s / REPLAY_S, playing=True))
        self.change(model, lambda player, end_s: player.advance(seconds, end_s))

    def move(self, model: Model, by: int) -> None:
        """Select another drop of the history page, from its beginning."""
        view, player = self.view(model), self.players["history"]
        self.players["history"] = player.other(by, len(view.jobs) if view else 1)
