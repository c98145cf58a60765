"""The pages as a site: all of them are there, and a link that leads nowhere ends the build."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest
from mkdocs.exceptions import Abort

ROOT = Path(__file__).parents[1]


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
    for folder in ("decisions", "results"):
        wanted |= {path.relative_to(ROOT) for path in ROOT.glob(f"docs/{folder}/**/*.md")}
    assert wanted <= built, "a new page takes its place in NAV of docs/site.py"
    for page in built:
        name = "index.html" if page.name == "README.md" else f"{page.stem}.html"
        assert (tmp_path / "site" / page.parent / name).is_file(), page
    text = (tmp_path / "site/index.html").read_text("utf-8")
    notebook = (tmp_path / "site/docs/notebook.html").read_text("utf-8")
    assert "session.analyze()" in notebook
    assert 'href="notebook.html"' in (tmp_path / "site/docs/python.html").read_text("utf-8")
    assert 'src="docs/figure-3.svg"' in text
    assert 'src="https:' not in text
    assert 'rel="stylesheet" href="https:' not in text


@pytest.mark.parametrize(
    ("link", "error"), [("nowhere.md", FileNotFoundError), ("b.md#nothing", Abort)]
)
def test_a_dead_link_ends_it(link, error, site, tmp_path, monkeypatch):
    (tmp_path / "docs").mkdir()
    (tmp_path / "README.md").write_text(f"# A\n\n[b](docs/b.md) [c](docs/{link})\n", "utf-8")
    (tmp_path / "docs/b.md").write_text("# B\n", "utf-8")
    monkeypatch.setattr(site, "ROOT", tmp_path)
    monkeypatch.setattr(site, "NAV", {"Learn": ("docs/b.md",)})
    with pytest.raises(error):
        site.main(tmp_path / "site")
