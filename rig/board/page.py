"""What stands on the page: the session as it is on the disk, and how its latest drop fell."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from rig.analysis.result import GOOD
from rig.board.picture import moving_picture
from rig.board.process import is_local
from rig.errors import RigError
from rig.files import file_stamp
from rig.records import Job
from rig.report.figure import COLUMN_PT, Chart
from rig.report.figures import result_figure
from rig.report.templates import environment, read_script
from rig.results.live import LiveAnalysis, SessionView
from rig.tui.drop_words import LOOKS, headline, past_runs, sentence
from rig.tui.motion import motions

_NOW = {"armed": " · is armed", "fired": " · falls"}


class BoardPage:
    """The page of a daemon.

    Parameters
    ----------
    address
        Where browsers find it.

    Attributes
    ----------
    digest
        Of its only script, as a security policy has it.
    """

    def __init__(self, address: str) -> None:
        from jinja2 import ChainableUndefined  # noqa: PLC0415 - pages only

        self._live: LiveAnalysis | None = None
        self._seen: object = None
        self._drawn: tuple[object, dict[str, Any]] = None, {}
        code = "" if is_local(address) else _qr_code(address)
        always = {"address": address, "code": code, **read_script("board.js")}
        templates = environment().overlay(undefined=ChainableUndefined)
        self._template = templates.get_template("board.html", globals=always)
        self.digest = always["digest"]

    def look(self, news: Mapping[str, Any]) -> str | None:
        """Return the page as it is now; `None` where nothing has changed.

        Parameters
        ----------
        news
            What the daemon told last: the path of its latest session, and the drop in hand.
        """
        path = Path(news["session"]) if news.get("session") else None
        if path is not None and (self._live is None or self._live.path != path):
            self._live, self._seen = LiveAnalysis(path), None
            return self._template.render(title=f"{path.name} is being read …")
        # A session that was closed stays on the page.
        seen = news, self._live and file_stamp(self._live.path)
        if seen == self._seen:
            return None
        self._seen = seen
        if self._live is None:
            return self._template.render(title="No session is open")
        try:
            return self._template.render(self._about(self._live.read(), news.get("drop") or {}))
        except RigError as error:
            return self._template.render(title="The session cannot be read", error=error)

    def _about(self, view: SessionView, drop: Mapping[str, Any]) -> dict[str, Any]:
        """Return what the page says; what takes long is drawn once of each state of the file."""
        key = view.path, view.states, view.fitted, view.blind
        if key != self._drawn[0]:
            self._drawn = key, _draw_parts(view)
        last = view.jobs[-1] if view.jobs else Job(min(view.plan), 1)
        job = Job(drop["run"], drop["attempt"]) if drop.get("run") in view.plan else last
        now = headline(view.plan[job.run], len(view.plan), job.attempt)
        return {
            "title": view.protocol.title,
            "view": view,
            "now": now + _NOW.get(drop.get("state", ""), ""),
            **self._drawn[1],
        }


def _draw_parts(view: SessionView) -> dict[str, Any]:
    """Return words and pictures of the latest drop, and of all."""
    chart = result_figure(view.analysis, view.curves)
    parts: dict[str, Any] = {"figure": chart and _svg(chart)}
    run, recorded = view.plan[min(view.plan)], None
    for job in view.jobs[-1:]:
        run, result = view.plan[job.run], view.results[job]
        recorded = view.drops[job], view.scales[job].hz, result
        parts |= {"said": sentence(view, job), "past": past_runs(view, job)}
        if result.verdict not in GOOD:
            reasons = "; ".join(map(str, result.reasons[:2]))
            parts["bad"] = f"{LOOKS[result.verdict][0]} {result.verdict}: {reasons}"
    falls = () if view.blind else motions(view.protocol, run, recorded)
    return parts | {"picture": falls and moving_picture(view.protocol, run, falls)}


def _svg(chart: Chart) -> str:
    """Draw a figure for the end of a room: without what is left over, and its type is large."""
    from rig.report.plot import page_svg  # noqa: PLC0415 - matplotlib, once something has fallen

    panels = [panel for panel in chart.panels if not panel.y.label.startswith("residual")]
    return page_svg(replace(chart, panels=panels), COLUMN_PT, "slim")


def _qr_code(address: str) -> str:
    import segno  # noqa: PLC0415 - only where others can see the page

    return segno.make(address, error="m", micro=False).svg_inline(border=2, omitsize=True)
