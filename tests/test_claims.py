"""No measured figure in README or docs without its row among the kept results.

A figure that was measured is written as a link to the page of docs/results in which it stands:
``[0.6 mm](results/…)``. Such pages are written by benches. Every other figure with a unit is a
given one (a setting, a limit, a dimension, an example), in ``given_figures.yaml`` with its origin.
"""

import re
from functools import cache
from pathlib import Path

import pytest

from tests.tables import read_csv, read_table

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "docs/results"
WORLD = ROOT / "docs/resolved-world.md"
KEPT = RESULTS / "resolved-world"

GIVEN_PAGES = {
    "docs/protocol.md": "limits and defaults, written from the code",
    "firmware/README.md": "circuits and data sheets",
}
GIVEN = read_table(__file__, "given_figures")

_CODE = re.compile(r"```.*?```|~~~.*?~~~|`[^`\n]*`", re.DOTALL)
_LINK = re.compile(r"!?\[([^\]]*)\]\(([^)\s]+)\)")
_NUMBER = r"[±−-]?[0-9][0-9,]*(?:\.[0-9]+)?"
_FIGURE = re.compile(
    rf"(?<![\w.,/-])({_NUMBER}(?: (?:±|to|and) {_NUMBER})*)[ \n]"
    r"(%|ppm|MiB|[MK]B|[nµm]?s|[nµmc]?m/s|[nµmc]?m|hours|minutes)(?![\w²³/])"
)


def pages() -> list[Path]:
    found = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    return [*found, ROOT / "firmware/README.md", ROOT / "firmware/emulator/README.md"]


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


@cache
def numbers_in(path: Path) -> frozenset[str]:
    return frozenset(re.findall(r"[0-9][0-9,]*(?:\.[0-9]+)?(?:e[+-]?[0-9]+)?", path.read_text()))


@pytest.mark.parametrize("page", pages(), ids=name_of)
def test_what_is_claimed_stands_in_its_row(page):
    for words, target in _LINK.findall(page.read_text("utf-8")):
        row = (page.parent / target.partition("#")[0]).resolve()
        if not row.is_relative_to(RESULTS) or row.suffix not in {".md", ".csv"}:
            continue
        for number in re.findall(r"[0-9][0-9,]*(?:\.[0-9]+)?", words):
            assert number in numbers_in(row), f"{words!r} is not in {target}"


@pytest.mark.parametrize("page", pages(), ids=name_of)
def test_every_other_figure_is_a_given_one(page):
    if name_of(page) in GIVEN_PAGES:
        return
    text = page.read_text("utf-8")
    if page == WORLD:
        text = re.sub(r"(?m)^ *\|.*", "", text)  # its tables are looked at below
        known = {number for row in tables(page) for cell in row
                 for number in re.findall(r"[0-9.]+", cell)}  # fmt: skip
    else:
        known = set()
    text = " ".join(_LINK.sub("", _CODE.sub("", text)).split())  # a figure may be broken
    given = GIVEN.get(name_of(page), {})
    found = set()
    for number, unit in _FIGURE.findall(text):
        figure = f"{number} {unit}"
        found.add(figure)
        said = figure in given or set(re.findall(r"[0-9.]+", number)) <= known
        assert said, (
            f"{figure}: measured? then make it a link to its row in docs/results; "
            "else say in tests/given_figures.yaml where it is from"
        )
    for place in given.values():
        assert "/" not in place or (ROOT / place).exists() or " " in place, place
    assert not set(given) - found, "no longer claimed: leave it out of the table"


def tables(page: Path) -> list[list[str]]:
    """Rows of all tables, by cells."""
    rows = re.findall(r"(?m)^ *\|(.*)\|$", page.read_text("utf-8"))
    return [[cell.strip() for cell in row.split("|")] for row in rows]


def test_fig_3_of_the_resolved_world_is_as_its_rows_say():
    told = {row[0]: row for row in tables(WORLD) if len(row) == 6}
    rows = [row for row in read_csv(KEPT / "figure-3-resolved.csv")
            if f"{float(row['incline_deg']):g}°" in told]  # fmt: skip
    assert len(rows) == 12
    for row in rows:
        cells = told[f"{float(row['incline_deg']):g}°"]
        mm, contact = (1e3 * float(row[name]) for name in ("separation_m", "contact_height_m"))
        assert cells[1] == f"{mm:.0f} ± {1e3 * float(row['separation_sd_m']):.0f}"
        assert cells[3] == f"{float(row['speed_m_s']):.2f} ± {float(row['speed_sd_m_s']):.2f}"
        assert cells[5] == f"{contact:.0f}"


def test_other_tables_of_the_resolved_world_are_as_their_rows_say():
    kept = {(row["what"], row["of"]): row for row in read_csv(KEPT / "resolved-published.csv")}
    looked = set()
    for row in tables(WORLD):
        for what, inclines in (("impulse over Eq. 9, rods", range(0, 90, 10)),
                               ("separation at strike (m)", (0, 30, 40, 60))):  # fmt: skip
            if (what, f"{row[0]}, {inclines[0]}°") not in kept:
                continue
            for incline, cell in zip(inclines, row[1:], strict=True):
                mean, sd = (float(kept[what, f"{row[0]}, {incline}°"][k]) for k in ("mean", "sd"))
                in_mm = f"{1e3 * mean:.0f} ± {1e3 * sd:.0f}"
                assert cell == (f"{mean:.2f}" if what.startswith("impulse") else in_mm)
            looked.add((what, row[0]))
    assert len(looked) == 15
    text = " ".join(WORLD.read_text("utf-8").split())
    for incline in (40, 30, 20, 11, 5):
        share = 100 * float(kept["friction along the slope over μN", f"{incline}°"]["mean"])
        assert re.search(rf"{share:.0f} %( of μN)? at\s+{incline}°", text)
    grown = [kept["Grewal: ahead at strike (m)", f"{n} rods"] for n in (15, 20, 25)]
    for row in grown:
        assert f"{1e3 * float(row['mean']):.0f} ± {1e3 * float(row['sd']):.0f}" in text
    for n in (20, 40, 80):
        assert f"{float(kept['Calkin and March: T/T_ff', f'{n} rods']['mean']):.3f}" in text
