"""The pages as a site: all of them are there, and a link that leads nowhere ends the build."""

import importlib.util
import re
from pathlib import Path

import pytest
from mkdocs.exceptions import Abort

from tests.refusals import refused

ROOT = Path(__file__).parents[1]
MOST_WORDS = 18_000
MOST_MENU_PAGES = 12
MOST_SECTIONS = 7
MOST_PICTURE_BYTES = 600 * 1024


def load(name):
    spec = importlib.util.spec_from_file_location(f"docs_{name}", ROOT / f"docs/{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def site():
    return load("site")


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
    assert "session.analyze()" in re.sub("<[^>]*>", "", notebook)  # without colours
    assert 'href="notebook.html"' in (tmp_path / "site/docs/python.html").read_text("utf-8")
    assert 'src="docs/pictures/loop.svg"' in text
    assert (tmp_path / "site/search/search_index.js").is_file()
    tabs = re.findall(r'class="md-tabs__link">\s*([^<]*?)\s*</a>', text)
    assert tabs == ["chainrig", *site.NAV, "Reference"]
    assert len(tabs) <= MOST_SECTIONS
    assert 'src="https:' not in text
    assert 'rel="stylesheet" href="https:' not in text


def test_it_is_short_enough_to_be_read(site, tmp_path):
    site.stage(tmp_path)
    words = site.count_words(tmp_path)
    assert words[Path("README.md")] > 300
    assert sum(words.values()) <= MOST_WORDS, sorted(words.items(), key=lambda row: -row[1])
    menu = {page for heading, found in site.pages().items() for page in found
            if heading in site.NAV} | {Path("README.md")}  # fmt: skip
    assert len(menu) <= MOST_MENU_PAGES, menu


def test_pictures_are_small_and_rest_for_whoever_asks_for_that():
    pictures = (ROOT / "docs/pictures").iterdir()
    assert sum(picture.stat().st_size for picture in pictures) <= MOST_PICTURE_BYTES
    loop = (ROOT / "docs/pictures/loop.svg").read_text("utf-8")
    assert loop == load("pictures").loop()
    assert loop.index("prefers-reduced-motion: no-preference") < loop.index("@keyframes")


@pytest.mark.parametrize(
    ("text", "words"), [("Δz ± 1.5e-3 mm", 2), ("`rig run` 12 | 1e-16, –", 2), ("3.3 V", 1)]
)
def test_a_word_has_a_letter_and_is_no_number(text, words, site, tmp_path):
    (tmp_path / "page.md").write_text(text, "utf-8")
    assert site.count_words(tmp_path) == {Path("page.md"): words}


@pytest.mark.parametrize(
    ("link", "error"), [("nowhere.md", FileNotFoundError), ("b.md#nothing", Abort)]
)
def test_a_dead_link_ends_it(link, error, site, tmp_path, monkeypatch):
    (tmp_path / "docs").mkdir()
    (tmp_path / "README.md").write_text(f"# A\n\n[b](docs/b.md) [c](docs/{link})\n", "utf-8")
    (tmp_path / "docs/b.md").write_text("# B\n", "utf-8")
    monkeypatch.setattr(site, "ROOT", tmp_path)
    monkeypatch.setattr(site, "NAV", {"Learn": ("docs/b.md",)})
    monkeypatch.setattr(site, "REFERENCE", {"Other": ()})
    refused(error, "", site.main, tmp_path / "site")
