"""A laid out figure as SVG: with classes inside a page, with its colours in a file."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from rig.report.looks import COLORS, FONT, LOOKS, SIZE

if TYPE_CHECKING:
    from rig.report.layout import Drawing, Path, Point


def page_svg(drawing: Drawing, title: str, kind: str) -> str:
    """Return SVG for a page that has `page_css`; `kind` is a further class."""
    body = [
        f'<path class="{path.look} c{path.color}" d="{_data(path)}"/>'
        for path in drawing.paths
        if path.lines
    ]
    body += _texts(drawing, ' class="c{0}"')
    return (
        f'<svg class="{kind}" viewBox="0 0 {drawing.width:g} {drawing.height:.0f}" role="img" '
        f'aria-label="{escape(title)}">{"".join(body)}</svg>'
    )


def file_svg(drawing: Drawing, title: str) -> str:
    """Return SVG that any program shows alike, on a ground of its own: viewers may be dark."""
    body = [f'<rect width="100%" height="100%" fill="{COLORS[-1][0]}"/>']
    for path in drawing.paths:
        look, color = LOOKS[path.look], COLORS[path.color][0]
        style = f'fill="{color}" fill-opacity="{look.opacity:g}"'
        if look.width:
            style = (
                f'fill="none" stroke="{color}" stroke-width="{look.width:g}" '
                f'stroke-opacity="{look.opacity:g}" stroke-linecap="{look.cap}"'
            )
        if look.dash:
            style += f' stroke-dasharray="{look.dash[0]:g} {look.dash[1]:g}"'
        body += [f'<path {style} d="{_data(path)}"/>'] if path.lines else []
    fills = [light for light, _ in COLORS]
    body += _texts(drawing, ' fill="{1}"', fills)
    width, height, lines = drawing.width, drawing.height, "\n".join(body)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}pt" height="{height:.0f}pt" '
        f'viewBox="0 0 {width:g} {height:.0f}" font-family="{FONT}, sans-serif" '
        f'font-size="{SIZE:g}"><title>{escape(title)}</title>\n{lines}\n</svg>\n'
    )


def page_css() -> str:
    """Return the rules of figures inside a page, for light and for dark."""
    rules = [
        f".fig text{{font-size:{SIZE:g}px;fill:var(--c);stroke:var(--paper);stroke-width:1.6;"
        "paint-order:stroke}"
    ]
    for name, look in LOOKS.items():
        dash = f";stroke-dasharray:{look.dash[0]:g} {look.dash[1]:g}" if look.dash else ""
        rules.append(
            f".fig .{name}{{fill:none;stroke:var(--c);stroke-width:{look.width:g};"
            f"stroke-opacity:{look.opacity:g};stroke-linecap:{look.cap}{dash}}}"
            if look.width
            else f".fig .{name}{{fill:var(--c);fill-opacity:{look.opacity:g}}}"
        )
    light, dark = (
        "".join(f".fig .c{n}{{--c:{pair[way]}}}" for n, pair in enumerate(COLORS)) for way in (0, 1)
    )
    return f"{''.join(rules)}{light}@media screen and (prefers-color-scheme:dark){{{dark}}}"


def _data(path: Path) -> str:
    """Write lines as path data; a dot is a line of no length, an area is closed."""
    close = "" if LOOKS[path.look].width else "z"
    return "".join(_line(line) + close for line in path.lines)


def _line(line: list[Point]) -> str:
    """Write whole tenths of a point, each place from the one before, without repeats."""
    (x, y), *rest = [(round(10 * x), round(10 * y)) for x, y in line]
    data = f"M{x / 10:g} {y / 10:g}"
    if rest == [(x, y)]:
        return f"{data}h0"
    last = "M"
    for nx, ny in rest:
        if (nx, ny) != (x, y):
            data += f"{'l' if last == 'M' else ' '}{(nx - x) / 10:g} {(ny - y) / 10:g}"
            x, y, last = nx, ny, "l"
    return data


def _texts(drawing: Drawing, style: str, fills: list[str] | None = None) -> list[str]:
    body = []
    for x, y, words, anchor, color, turned in drawing.texts:
        place = f'transform="translate({x:.1f} {y:.1f})rotate(-90)"' if turned else (
            f'x="{x:.1f}" y="{y:.1f}"'
        )  # fmt: skip
        at = f' text-anchor="{anchor}"' if anchor != "start" else ""
        shade = style.format(color, fills[color] if fills else "")
        body.append(f"<text {place}{at}{shade}>{escape(words)}</text>")
    return body
