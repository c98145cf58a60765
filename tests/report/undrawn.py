"""Figures at which nobody looks: to draw them takes longer than all else on a page."""

from collections.abc import Iterator
from html import escape

import pytest

from rig.report.figure import Chart


def _page_svg(chart: Chart, width: float, kind: str, mark: str = "f") -> str:
    return f'<svg class="{kind}" id="{mark}"><title>{escape(chart.title)}</title></svg>'


@pytest.fixture(scope="module")
def undrawn() -> Iterator[None]:
    """Have the figures of a module's pages and bundles be their titles.

    That pages and bundles have figures, and the same again, is for tests/cli/test_analyze_report.py
    and tests/test_without_unix.py; that they can be drawn of any scene, for tests/scenes.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rig.report.plot.page_svg", _page_svg)
        for place in ("rig.report.canvas", "rig.commands.bundling"):
            patch.setattr(f"{place}.figure_file", lambda figure, kind: figure.title.encode())
        yield
