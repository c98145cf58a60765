"""What stands on the page: the session as it is on the disk, and how its latest drop fell."""

from __future__ import annotations

import base64
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.analysis.result import GOOD
from rig.board.picture import moving_picture
from rig.board.process import is_local
from rig.errors import RigError
from rig.files import file_stamp
from rig.report import looks
from rig.report.figure import COLUMN_PT
from rig.report.figures import result_figure
from rig.report.templates import environment, render
from rig.results.live import LiveAnalysis
from rig.tui.drop_words import LOOKS, headline, past_runs, sentence
from rig.tui.motion import motions

if TYPE_CHECKING:
    from rig.records import Job
    from rig.report.figure import Chart
    from rig.results.live import SessionView

_NOW = {"armed": "is armed", "fired": "falls"}
_HERE = Path(__file__).parent
SCRIPT = (_HERE / "board.js").read_text("utf-8")
SCRIPT_DIGEST = f"sha256-{base64.b64encode(sha256(SCRIPT.encode()).digest()).decode()}"


class BoardPage:
    """The page of a daemon.

    Parameters
    ----------
    address
        Where browsers find it.
    """

    def __init__(self, address: str) -> None:
        from jinja2 import FileSystemLoader, Undefined  # noqa: PLC0415 - pages only

        self.address = address
        self._live: LiveAnalysis | None = None
        self._seen: object = None
        self._drawn: tuple[object, dict[str, Any]] = None, {}
        self._templates = environment().overlay(loader=FileSystemLoader(_HERE), undefined=Undefined)
        self._shell = {
            "address": address,
            "code": "" if is_local(address) else _qr_code(address),
            "css": f"{render('figure.css', looks=looks)}{(_HERE / 'board.css').read_text('utf-8')}",
            "script": SCRIPT,
        }

    def look(self, news: dict[str, Any]) -> str | None:
        """Return the page as it is now; `None` where nothing has changed.

        Parameters
        ----------
        news
            What the daemon told last: its session's path, and the drop in hand.
        """
        path = Path(news["session"]) if news.get("session") else None
        if path is not None and (self._live is None or self._live.path != path):
            self._live, self._drawn, self._seen = LiveAnalysis(path), (None, {}), None
            return self._render({"title": f"{path.name} is being read …"})
        seen: object = news
        if self._live is not None:  # a session that was closed stays on the page
            seen = (news, file_stamp(self._live.path))
        if seen == self._seen:
            return None
        self._seen = seen
        if self._live is None:
            return self._render({"title": "No session is open"})
        try:
            return self._render(self._about(self._live, news))
        except RigError as error:
            title = "The session cannot be read"
            return self._render({"title": title, "trouble": f"{error.message} ({error.hint})"})

    def _render(self, about: dict[str, Any]) -> str:
        text: str = self._templates.get_template("board.html").render(about | self._shell)
        return text

    def _about(self, live: LiveAnalysis, news: dict[str, Any]) -> dict[str, Any]:
        view = live.read()
        job = view.jobs[-1] if view.jobs else None
        key = (view.path, view.states, view.fitted, view.blind)
        if key != self._drawn[0]:
            self._drawn = key, _drawn(view, job)
        drop, total = news.get("drop") or {}, len(view.plan)
        if drop.get("state") in _NOW and drop["run"] in view.plan:
            words = headline(view.plan[drop["run"]], total, drop["attempt"])
            now = f"{words} · {_NOW[drop['state']]}"
        elif job is not None:
            now = headline(view.plan[job.run], total, job.attempt)
        else:
            now = f"{total} runs are planned"
        return {
            "title": view.protocol.title,
            "simulated": view.simulated,
            "blind": view.blind,
            "now": now,
            **self._drawn[1],
        }


def _drawn(view: SessionView, job: Job | None) -> dict[str, Any]:
    """Return words and pictures of the latest drop, and of all."""
    gravity = view.protocol.gravity.value
    chart = result_figure(view.analysis, view.curves, site_m_s2=gravity)
    run, recorded, said, good = view.plan[min(view.plan)], None, "", True
    if job is not None:
        run, result = view.plan[job.run], view.results[job]
        recorded, good = (view.drops[job], view.scales[job].hz, result), result.verdict in GOOD
        said = sentence(view, job)
        if not good:
            reasons = "; ".join(map(str, result.reasons[:2]))
            said = f"{LOOKS[result.verdict][0]} {result.verdict}: {reasons}"
    falls = () if view.blind else motions(view.protocol, run, recorded)
    return {
        "said": said,
        "good": good,
        "past": past_runs(view, job) if job is not None else "",
        "picture": moving_picture(view.protocol, run, falls) if falls else None,
        "figure": "" if chart is None else _svg(chart),
        "together": bool(view.fitted),
    }


def _svg(chart: Chart) -> str:
    """Draw a figure for the end of a room: without what is left over, and its type is large."""
    from rig.report.plot import page_svg  # noqa: PLC0415 - matplotlib, once something has fallen

    panels = [panel for panel in chart.panels if not panel.y.label.startswith("residual")]
    return page_svg(replace(chart, panels=panels), COLUMN_PT, "slim")


def _qr_code(address: str) -> str:
    import segno  # noqa: PLC0415 - only where others can see the page

    return segno.make(address, error="m", micro=False).svg_inline(border=2, omitsize=True)
