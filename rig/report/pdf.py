"""Conversion of a page to PDF by WeasyPrint (the extra ``pdf``), without a browser."""

import base64
import re
from contextlib import redirect_stdout
from html import escape
from io import StringIO

from rig.files import write_atomic
from rig.reasons import rig_error
from rig.report.canvas import figure_file

try:
    with redirect_stdout(StringIO()):  # it prints links where a library is missing
        from weasyprint import HTML
except OSError as error:
    raise rig_error("no_pango") from error

from collections.abc import Sequence
from pathlib import Path

from rig.report.figure import Chart

_DRAWN = re.compile(r'(?<=<figure class="fig">).*?(?=<figcaption>)', re.DOTALL)


def write_pdf(path: Path, html: str, figures: Sequence[Chart]) -> None:
    """Write a page as PDF, with figures as in their files, and attachments.

    Parameters
    ----------
    html, figures
        Results of `rig.report.templates.page_html`.
    """
    charts = iter(figures)

    def picture(_: re.Match[str]) -> str:
        chart = next(charts)
        svg = base64.b64encode(figure_file(chart, "svg")).decode()
        return f'<img alt="{escape(chart.title)}" src="data:image/svg+xml;base64,{svg}">'

    write_atomic(path, HTML(string=_DRAWN.sub(picture, html)).write_pdf())
