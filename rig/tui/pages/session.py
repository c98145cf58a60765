"""The session so far: the plan with its states, results against incline, the control chart."""

from collections.abc import Iterable, Iterator
from pathlib import Path

from textual.content import Content

from rig.analysis.joint_fit import FEWEST
from rig.analysis.session import Analysis
from rig.campaign.plan import done
from rig.report.columns import Part
from rig.report.parts import means_parts, scatter_parts, tables
from rig.tui.desk import Desk, Face
from rig.tui.drop_words import LOOKS
from rig.tui.model import Model
from rig.tui.plots import session_pictures
from rig.tui.widgets.text import duration, plain


def face(model: Model, desk: Desk) -> Face:
    """Return the session page: plan, results against incline, and control charts."""
    view = model.view
    if view is None:
        return Face(_progress(model))
    key = view.path, view.reading
    means = desk.latest("means", key, lambda: _table(tables("means", view.analysis.summary)))
    drops = desk.latest("drops", key, lambda: _drop_tables(view.analysis))
    head = Content("\n").join([_progress(model), means])
    shown = desk.latest("charts", key, lambda: [*session_pictures(view)])
    turned = desk.chart % max(1, len(shown))
    pictures = [*shown[turned:], *shown[:turned]]
    foot = pictures[0][1] if pictures else ""
    drawn = [picture for picture, _ in pictures]
    return Face(head, pictures=drawn, foot=Content(foot), beside=2, words=drops)


def _drop_tables(analysis: Analysis) -> Content:
    means, runs = analysis.summary, analysis.runs
    return _table([*means_parts(means), *scatter_parts(means), *tables("runs", runs)])


def _progress(model: Model) -> Content:
    runs = model.state.runs
    if model.loading or not runs:
        return Content(model.loading or "No session is open.")
    voids = model.voids.counts(runs)
    over = sum(done(line, voids.get(line.run, 0)) for line in runs)
    pace = model.view.pace_s if model.view else None
    left_s = (pace or 0.0) * (len(runs) - over)
    remaining = f" · about {duration(left_s)} left" * bool(left_s)
    session = plain(Path(str(model.state.section("session").get("path", ""))).name, 60)
    return Content.assemble(
        (f"{over} of {len(runs)} runs", "bold"),
        f"{remaining}  ",
        (session, "$foreground 70%"),
        _fit_words(model),
        "\n",
        *_marks(model),
    )


def _table(parts: Iterable[Part]) -> Content:
    return Content("\n".join(line for part in parts for line in part.lines if line))


def _fit_words(model: Model) -> tuple[str, str]:
    """Return in words whether the means come from a joint fit."""
    view = model.view
    if view is None or not view.analysis.summary:
        return "", ""
    alone = f"each drop fitted alone; joint fit from {FEWEST} good drops on"
    fit = f"joint fit of {view.fitted} runs" if view.fitted else alone
    return f"\n{fit}{' · adding the newest …' * view.lagging}", "$foreground 70%"


def _marks(model: Model) -> Iterator[tuple[str, str]]:
    """Yield a symbol for each run in order; the present run in reverse colours."""
    present = model.job.run if model.job else None
    for line in model.state.runs:
        symbol, colour = LOOKS.get(line.state, ("?", "$foreground"))
        yield symbol, f"{colour} reverse" if line.run == present else colour
