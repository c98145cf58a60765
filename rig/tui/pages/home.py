"""Home: try it, connect a board, continue, begin something new, or look at results."""

from functools import partial
from itertools import groupby

from textual.content import Content

from rig.campaign.machine import Stage
from rig.predictions import notes
from rig.protocol.describe import describe
from rig.protocol.protocol import Protocol
from rig.text_rows import read_paragraphs
from rig.tui.beginnings import Beginning
from rig.tui.desk import Desk, Face
from rig.tui.model import Model
from rig.tui.motion import motions
from rig.tui.scale import Drawing, drawing
from rig.tui.widgets.text import link_action, plain

_FALLEN = 0.7  # share of the fall shown in small pictures
_DOES = {kind: "\n".join(lines) for kind, *lines in read_paragraphs(__file__)}


def face(model: Model, desk: Desk) -> Face:
    """Return the home page: possible beginnings, or the protocol of the open session."""
    protocol, menu, picture = model.protocol, Content(""), None
    parts: list[Content] = []
    if model.flow.stage is Stage.PROTOCOL or protocol is None:
        row = desk.chosen
        if row is None:
            return Face(Content("looking around …"))
        protocol, problem = desk.reading(row.file) if row.file else (None, "")
        parts, menu = [Content(_DOES.get(row.kind) or _into(model, desk, row))], _menu(desk)
        if problem:
            protocol = None
            parts = [Content.assemble((f"✗ {plain(row.file)}\n\n", "bold $error"), problem)]
    if protocol is not None:
        parts.append(desk.latest("description", protocol, partial(_describe_protocol, protocol)))
        picture = desk.latest("picture", protocol, partial(_picture, protocol))
    return Face(drawing=picture, words=Content("\n\n").join(parts), menu=menu, top=True)


def _into(model: Model, desk: Desk, row: Beginning) -> str:
    """Return the rig and session file of an experiment in words."""
    session = plain(row.session or desk.options.session or "")
    rig = model.client.port or "a simulation: no board is connected"
    return f"→ Enter opens it with {rig}\n→ session file: {session or 'a new one'}"


def _menu(desk: Desk) -> Content:
    lines: list[Content] = []
    for section, group in groupby(enumerate(desk.rows), key=lambda row: row[1].section):
        lines.append(Content.styled(section, "bold $foreground 70%"))
        for at, row in group:
            mark, style = ("▸", "bold $primary") if row is desk.chosen else (" ", "")
            text = Content.styled(f"{mark} {plain(row.title, 30)}", style)
            lines.append(link_action(text, f"app.choose({at})"))
    return Content("\n").join(lines)


def _picture(protocol: Protocol) -> Drawing | None:
    """Return a drawing of the predicted fall, part of the way down."""
    run = protocol.runs()[0]
    falls = motions(protocol, run)
    end = max((fall.end_s for fall in falls), default=0.0)
    return drawing(protocol, run, falls, (), _FALLEN * end) if falls else None


def _describe_protocol(protocol: Protocol) -> Content:
    title, *lines = describe(protocol, notes(protocol)).splitlines()
    parts = [Content.styled(plain(title, 200), "bold")]
    for line in lines:
        style = "" if line.startswith(" ") else "bold $primary"
        parts.append(Content.styled(plain(line, 200), style))
    return Content("\n").join(parts)
