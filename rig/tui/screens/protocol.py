"""Choose a protocol, and see its plan, or what is wrong with it at which line."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from textual.containers import Horizontal, VerticalScroll
from textual.content import Content

from rig.campaign.events import Stage
from rig.errors import InputError
from rig.predictions import notes
from rig.protocol import reader
from rig.protocol.describe import describe
from rig.protocol.measurable import check_gates, check_recordable
from rig.tui.screens.page import Page
from rig.tui.widgets.text import Words, plain, pressed

if TYPE_CHECKING:
    from pathlib import Path

    from textual.app import ComposeResult

    from rig.protocol.protocol import Protocol
    from rig.tui.context import Options
    from rig.tui.model import Model


_FIRST = "Plan and limits"
"""The section that is read first here: a screen has no room for all of them."""


class ProtocolPage(Page):
    """Files left, the chosen one's scene and plan right."""

    SCOPED_CSS = False
    DEFAULT_CSS = """
    ProtocolPage #files { width: 30; height: 1fr; border-right: solid $border; }
    ProtocolPage VerticalScroll { width: 1fr; padding: 0 1; }
    ProtocolPage #scene { width: 1fr; }
    """

    def __init__(self, options: Options) -> None:
        super().__init__(options)
        self.files = options.files
        self.chosen = -1  # none yet

    def compose(self) -> ComposeResult:
        with Horizontal():
            yield Words(id="files")
            with VerticalScroll(can_focus=False):
                yield Words(id="scene")

    @property
    def file(self) -> Path | None:
        """The chosen file."""
        return self.files[max(0, self.chosen)] if self.files else None

    @property
    def usable(self) -> bool:
        """Whether a session can be made with it."""
        return not self._reading.problem

    @property
    def _reading(self) -> _Reading:
        """The chosen file, read again when it changed: it may be open in an editor beside this."""
        if self.file is None:
            return _Reading(
                None, "Leave this screen, write an experiment with rig new, and come back."
            )
        try:
            changed_ns = self.file.stat().st_mtime_ns
        except OSError:
            changed_ns = -1
        file = self.file
        return self.latest("reading", (file, changed_ns), lambda: _read(file))

    def move(self, by: int) -> None:
        """Choose another file."""
        if self.files:
            self.chosen = (max(0, self.chosen) + by) % len(self.files)
            self.query_one(VerticalScroll).scroll_home(animate=False)

    def choose(self, at: int) -> None:
        """Choose a file by mouse."""
        self.move(at - self.chosen)

    def show(self, model: Model) -> None:
        """Draw the list, and the running session's protocol once there is one."""
        running = None if model.flow.stage is Stage.PROTOCOL else model.protocol
        self.query_one("#files", Words).display = running is None
        if running is not None:
            self.say("scene", self._description(running))
            return
        if self.chosen < 0:
            self._choose_usable()
        rows = []
        for at, file in enumerate(self.files):
            mark = "▸ " if at == self.chosen else "  "
            style = "bold $primary" if at == self.chosen else "$foreground"
            row = Content.styled(mark + plain(file.stem, 25), style)
            rows.append(pressed(row, f"app.choose('protocol', {at})"))
        if not rows:
            rows = [Content("no experiment in this folder")]
        if self.options.last is not None:
            last = Content.assemble("\nlast session:\n", ("o ", "bold $primary"),
                                    plain(self.options.last.stem, 24))  # fmt: skip
            rows.append(pressed(last, "app.do('sessions')"))
        self.say("files", Content("\n").join(rows))
        protocol, problem = self._reading
        if protocol is None or problem:
            name = plain(self.file) if self.file else "no experiment in this folder"
            self.say("scene", (f"✗ {name}\n\n", "bold $error"), problem)
            return
        session = plain(self.options.session) if self.options.session else ""
        into = Content.assemble(("→ ", "$primary"), f"session file: {session}\n\n")
        self.say("scene", Content.assemble(into if session else "", self._description(protocol)))

    def _choose_usable(self) -> None:
        """Begin with the first file that can be used here, or with the first if none can."""
        for at in range(len(self.files)):
            self.chosen = at
            if self.usable:
                return
        self.chosen = 0

    def _description(self, protocol: Protocol) -> Content:
        return self.latest("description", protocol, lambda: _described(protocol))


class _Reading(NamedTuple):
    """A protocol, and what is wrong with its file; empty where it can be used."""

    protocol: Protocol | None
    problem: str = ""


def _read(file: Path) -> _Reading:
    protocol = None
    try:
        protocol = reader.read(file)
        check_gates(protocol)
        check_recordable(protocol)
    except InputError as error:
        lines = [plain(problem, 300) for problem in error.problems]
        return _Reading(protocol, "\n".join(lines or [plain(error.message), plain(error.hint)]))
    return _Reading(protocol)


def _described(protocol: Protocol) -> Content:
    lines = [plain(line, 200) for line in describe(protocol, notes(protocol)).splitlines()]
    title, *rest = lines
    begins = [at for at, line in enumerate(rest) if line and not line.startswith(" ")]
    sections = [rest[at:end] for at, end in zip(begins, [*begins[1:], len(rest)], strict=True)]
    sections.sort(key=lambda section: section[0] != _FIRST)
    parts = [Content.styled(title, "bold"), Content("")]
    for head, *facts in sections:
        parts += [Content.styled(head, "bold $primary"), *map(Content, facts)]
    return Content("\n").join(parts)
