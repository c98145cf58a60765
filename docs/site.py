"""Builds the pages of this project as a site: ``./run docs``, or ``python docs/site.py FOLDER``.

Pages stand where they are read in the repository; here they are put side by side for MkDocs, with
what they link to. A link that leads nowhere ends the build.
"""

from __future__ import annotations

import json
import re
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from mkdocs.commands.build import build
from mkdocs.config import load_config

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
NAV: dict[str, tuple[str, ...]] = {
    "Start": ("docs/build.md", "docs/one-object.md", "docs/tutorial.md"),
    "Set up": ("docs/boards.md", "firmware/README.md", "docs/daemon.md",
               "docs/troubleshooting.md"),
    "Use results": ("docs/python.md", "docs/timers.md"),
    "Understand": ("docs/method.md", "docs/accuracy.md"),
}  # fmt: skip
"""The menu: by heading, pages that each answer one question of a user."""
REFERENCE: dict[str, tuple[str, ...]] = {
    "Files and interfaces": (
        "docs/protocol.md", "docs/glossary.md", "docs/notebook.ipynb", "docs/tui/README.md",
        "rig/daemon/API.md", "firmware/PROTOCOL.md",
    ),
    "Proofs": ("docs/results/README.md", "docs/first-board.md", "docs/resolved-world.md",
               "docs/results/[a-z]*.md", "docs/results/*/*.md"),
    "The project": ("docs/architecture.md", "docs/decisions.md", "CONTRIBUTING.md"),
}  # fmt: skip
"""Pages to look something up in, by group: all of them below one heading of the menu."""
FILES = ("docs/site.css", "docs/site.js", "docs/iframe-worker.js", "docs/icon.svg")
"""What all pages use."""
LANDING = """---
hide: [navigation, toc]
---
<div class="landing" markdown>

{text}
</div>
"""
_NESTED = re.compile(r"^  - ", re.MULTILINE)
_LETTER = re.compile(r"[^\W\d_]")
_NUMBER = re.compile(r"[-+−]?[\d.]+e[-+]?\d+")
_LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")


def pages() -> dict[str, list[Path]]:
    """Return all pages by heading, as paths from the project's root."""
    return {
        heading: [path.relative_to(ROOT) for name in names for path in sorted(ROOT.glob(name))]
        for heading, names in (NAV | REFERENCE).items()
    }


def count_words(folder: Path) -> dict[Path, int]:
    """Count the words of each staged page: tokens with a letter, code included, numbers not."""
    return {
        page.relative_to(folder): sum(map(_is_word, page.read_text("utf-8").split()))
        for page in sorted(folder.rglob("*.md"))
    }


def _is_word(token: str) -> bool:
    return bool(_LETTER.search(token)) and not _NUMBER.fullmatch(token.strip(".,;:()"))


def stage(folder: Path) -> None:
    """Copy all pages and what they show into a folder, each where it stands in the project.

    Links to other files of the project are shown as text: a site has no code.

    Raises
    ------
    FileNotFoundError
        A link leads nowhere.
    """
    known = {Path("README.md"), *(page for found in pages().values() for page in found)}
    for name in FILES:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(DOCS.parent / name, folder / name)
    for page in known:
        text = (ROOT / page).read_text("utf-8")
        there = folder / as_page(page)
        there.parent.mkdir(parents=True, exist_ok=True)
        if page.suffix == ".ipynb":
            text = told(text)
        text = _LINK.sub(lambda link, at=page: _linked(link, at, known, folder), text)
        text = _NESTED.sub("    - ", text)  # Python's Markdown nests by four blanks
        home = page == Path("README.md")
        there.write_text(LANDING.format(text=text) if home else text, "utf-8")


def as_page(path: Path) -> Path:
    """Where the page of a file stands: a notebook becomes one."""
    return path.with_suffix(".md") if path.suffix == ".ipynb" else path


def told(notebook: str) -> str:
    """Write a notebook's words and code as a page; it is kept without what it prints."""
    cells = ("".join(cell["source"]) if cell["cell_type"] == "markdown"
             else "".join(["```python\n", *cell["source"], "\n```"])
             for cell in json.loads(notebook)["cells"])  # fmt: skip
    return "\n\n".join(cells) + "\n"


def _linked(link: re.Match[str], page: Path, known: set[Path], folder: Path) -> str:
    picture, words, target = link.groups()
    place, hash_, anchor = target.partition("#")
    if not place or "://" in place:
        return link[0]
    source = (ROOT / page).parent / place
    if not source.exists():
        raise FileNotFoundError(f"{page}: {target} leads nowhere")
    inside = source.resolve().relative_to(ROOT)
    if inside in known:
        return f"{picture}[{words}]({as_page(Path(place)).as_posix()}{hash_}{anchor})"
    listed = sorted(one for one in known if one.parent == inside)
    if listed:  # a folder of pages: the first of them, and the menu has the rest
        return f"[{words}]({place.rstrip('/')}/{listed[0].name}{hash_}{anchor})"
    if picture or source.suffix in {".svg", ".png", ".csv", ".json", ".yaml", ".txt"}:
        (folder / inside).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, folder / inside)
        return link[0]
    return words


def settings(source: Path, site: Path) -> dict[str, Any]:
    """Make MkDocs' settings, with every doubtful link a warning."""
    entries = {
        heading: [str(as_page(page)) for page in group] for heading, group in pages().items()
    }
    nav: list[dict[str, Any]] = [{"chainrig": "README.md"}]
    nav += [{heading: entries[heading]} for heading in NAV]
    nav.append({"Reference": [{group: entries[group]} for group in REFERENCE]})
    doubts = {"not_found": "warn", "anchors": "warn", "unrecognized_links": "warn"}
    return {
        "site_name": "chainrig",
        "site_description": "Drop it. Time it. Believe the number.",
        "docs_dir": str(source),
        "site_dir": str(site),
        "theme": {
            "name": "material",
            "font": False,  # those of the reader's machine: nothing is fetched from elsewhere
            "favicon": "docs/icon.svg",
            "logo": "docs/icon.svg",
            "palette": [_palette(*scheme) for scheme in SCHEMES],
            "features": ["navigation.tabs", "navigation.top", "navigation.footer",
                         "content.code.copy", "search.highlight", "toc.follow"],
        },
        "extra_css": ["docs/site.css"],
        "extra_javascript": ["docs/site.js"],
        "extra": {"generator": False, "polyfills": ["docs/iframe-worker.js"]},
        "plugins": ["search", "offline"],
        "markdown_extensions": [
            "admonition", "attr_list", "md_in_html", "tables", {"toc": {"permalink": True}},
            {"pymdownx.highlight": {"anchor_linenums": False}}, "pymdownx.superfences",
        ],
        "nav": nav,
        "strict": True,
        "use_directory_urls": False,  # so that it can be read without a server
        "validation": {"nav": {"not_found": "warn"}, "links": doubts},
    }  # fmt: skip


SCHEMES = (
    ("(prefers-color-scheme)", "default", "material/brightness-auto", "Use light colours"),
    ("(prefers-color-scheme: light)", "default", "material/weather-sunny", "Use dark colours"),
    ("(prefers-color-scheme: dark)", "slate", "material/weather-night", "Use the system's colours"),
)
"""When each colour scheme is used, its name, and the button that leads to the next."""


def _palette(media: str, scheme: str, icon: str, button: str) -> dict[str, Any]:
    return {
        "media": media, "scheme": scheme, "primary": "custom", "accent": "custom",
        "toggle": {"icon": icon, "name": button},
    }  # fmt: skip


def main(site: Path) -> None:
    """Build the site in a folder."""
    with tempfile.TemporaryDirectory() as folder:
        stage(Path(folder))
        config = Path(folder).parent / f"{Path(folder).name}.yml"
        config.write_text("", "utf-8")
        try:
            build(load_config(str(config), **settings(Path(folder), site.absolute())))
        finally:
            config.unlink()
    print(site / "index.html")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "out" / "site")
