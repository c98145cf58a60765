"""Choose a protocol, and see its plan, or what is wrong with it at which line."""

from __future__ import annotations

from typing import TYPE_CHECKING

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
    from rig.tui.model import Model


_FIRST = "Plan and limits"
"""The section that is read first here: a screen has no room for all of them."""


class ProtocolPage(Page):
    """Files left, the chosen one's scene and plan right."""

    NAME = "protocol"
    SCOPED_CSS = False
    DEFAULT_CSS = """
    ProtocolPage #files { width: 30; height: 1fr; border-right: solid $border; }
    ProtocolPage VerticalScroll { width: 1fr; padding: 0 1; }
    ProtocolPage #scene { width: 1fr; }
    """

    def __init__(
        self, files: tuple[Path, ...], session: Path | None, last: Path | None = None
    ) -> None:
        super().__init__()
        self.files = files
        self.session = session
        self.last = last
        self.chosen = -1  # none yet
        self._read: tuple[Path, int] | None = None
        self._protocol: Protocol | None = None
        self._problem = ""
        self._described: tuple[Protocol, Content] | None = None

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
        return self._protocol is not None and not self._problem

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
            self.query_one("#scene", Words).say(self._description(running))
            return
        if self.chosen < 0:
            self._choose_usable()
        self._look()
        rows = []
        for at, file in enumerate(self.files):
            mark = "▸ " if at == self.chosen else "  "
            style = "bold $primary" if at == self.chosen else "$foreground"
            row = Content.styled(mark + plain(file.stem, 25), style)
            rows.append(pressed(row, f"app.choose('protocol', {at})"))
        if not rows:
            rows = [Content("no experiment in this folder")]
        if self.last is not None:
            last = Content.assemble("\nlast session:\n", ("o ", "bold $primary"),
                                    plain(self.last.stem, 24))  # fmt: skip
            rows.append(pressed(last, "app.do('sessions')"))
        self.query_one("#files", Words).say(Content("\n").join(rows))
        if self._protocol is None or self._problem:
            name = plain(self.file) if self.file else "no experiment in this folder"
            self.query_one("#scene", Words).say((f"✗ {name}\n\n", "bold $error"), self._problem)
            return
        session = plain(self.session) if self.session else ""
        into = Content.assemble(("→ ", "$primary"), f"session file: {session}\n\n")
        self.query_one("#scene", Words).say(
            Content.assemble(into if session else "", self._description(self._protocol))
        )

    def _choose_usable(self) -> None:
        """Begin with the first file that can be used here, or with the first if none can."""
        for at in range(len(self.files)):
            self.chosen = at
            self._look()
            if self.usable:
                return
        self.chosen = 0

    def _description(self, protocol: Protocol) -> Content:
        """Describe a protocol, once: this is drawn many times a second, and predicts."""
        if self._described is None or self._described[0] is not protocol:
            self._described = protocol, _described(protocol)
        return self._described[1]

    def _look(self) -> None:
        """Read the chosen file again when it changed: it may be open in an editor beside this."""
        file = self.file
        if file is None:
            self._problem = "Leave this screen, write an experiment with rig new, and come back."
            return
        try:
            stamp = file, file.stat().st_mtime_ns
        except OSError:
            stamp = file, -1
        if stamp == self._read:
            return
        self._read, self._protocol, self._problem = stamp, None, ""
        try:
            self._protocol = reader.read(file)
            check_gates(self._protocol)
            check_recordable(self._protocol)
        except InputError as error:
            lines = [plain(problem, 300) for problem in error.problems]
            self._problem = "\n".join(lines or [plain(error.message), plain(error.hint)])


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
