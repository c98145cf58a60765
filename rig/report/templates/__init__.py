"""Templates of pages and figures, and what fills them."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from rig.report import numbers

if TYPE_CHECKING:
    from jinja2 import Environment

_CODE = re.compile("`([^`]*)`")


@cache
def environment() -> Environment:
    """Return the templates; they escape all text."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined  # noqa: PLC0415 - pages only

    loader = FileSystemLoader(Path(__file__).parent)
    templates = Environment(loader=loader, autoescape=True, undefined=StrictUndefined)
    templates.filters |= {
        "prose": _prose,
        "plus_minus": numbers.plus_minus,
        "with_unit": numbers.with_unit,
        "signed": numbers.signed,
    }
    templates.globals["ranges"] = numbers.ranges
    return templates


def render(name: str, **values: object) -> str:
    """Fill a template.

    Returns
    -------
    Markup
        Which other templates need not escape.
    """
    from markupsafe import Markup  # noqa: PLC0415 - comes with Jinja2

    return Markup(environment().get_template(name).render(values))  # noqa: S704 - just escaped


def sentence(name: str, *values: object) -> str:
    """Write a sentence of ``words.txt``."""
    from markupsafe import Markup  # noqa: PLC0415 - comes with Jinja2

    write = getattr(environment().get_template("words.txt").module, name)
    return Markup(write(*values)).unescape()  # noqa: S704 - for a terminal too


def _prose(sentence: str) -> str:
    """Escape a sentence, and set its keys and commands in code type."""
    from markupsafe import Markup, escape  # noqa: PLC0415 - comes with Jinja2

    return Markup(_CODE.sub(r"<code>\1</code>", str(escape(sentence))))  # noqa: S704 - just escaped
