"""The pages as a site: all of them are there, and a link that leads nowhere ends the build."""

import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MOST_WORDS = 18_000
MOST_MENU_PAGES = 12


@pytest.fixture
def site():
    spec = importlib.util.spec_from_file_location("pages_as_a_site", ROOT / "docs/site.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_all_pages_are_in_the_site(site, tmp_path):
    site.main(tmp_path / "site")
    built = {page for found in site.pages().values() for page in found}
    wanted = {path.relative_to(ROOT) for path in ROOT.glob("docs/*.md")}
    wanted |= {path.relative_to(ROOT) for path in ROOT.glob("docs/*.ipynb")}
    wanted |= {path.relative_to(ROOT) for path in ROOT.glob("docs/results/**/*.md")}
    assert wanted <= built, "a new page takes its place in NAV or REFERENCE of docs/site.py"
    for page in built:
        name = "index.html" if page.name == "README.md" else f"{page.stem}.html"
        assert (tmp_path / "site" / page.parent / name).is_file(), page
    text = (tmp_path / "site/index.html").read_text("utf-8")
    notebook = (tmp_path / "site/docs/notebook.html").read_text("utf-8")
    assert "session.analyze()" in notebook
    assert 'href="notebook.html"' in (tmp_path / "site/docs/python.html").read_text("utf-8")
    assert 'src="docs/figure-3.svg"' in text
    assert "All pages" in text  # the folded group
    assert 'src="https:' not in text
    assert 'rel="stylesheet" href="https:' not in text


def test_it_is_short_enough_to_be_read(site, tmp_path):
    site.stage(tmp_path)
    words = site.count_words(tmp_path)
    assert words[Path("README.md")] > 300
    assert sum(words.values()) <= MOST_WORDS, sorted(words.items(), key=lambda row: -row[1])
    menu = {page for heading, found in site.pages().items() for page in found
            if heading != "Reference"} | {Path("README.md")}  # fmt: skip
    assert len(menu) <= MOST_MENU_PAGES, menu
