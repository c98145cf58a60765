"""What is typed, and what comes of it; what is refused leaves everything as it was."""

import shlex
from pathlib import Path

import pytest

from tests.tables import read_table

STORIES = read_table(__file__, "stories")


@pytest.fixture
def here(finished, fences, tmp_path, monkeypatch):
    places = {"chains.yaml": finished.protocol, "chains.session": finished.session}
    places |= {"fence.yaml": fences.with_name("fences.yaml"), "fence.session": fences}
    for name, source in places.items():
        (tmp_path / name).write_bytes(source.read_bytes())
    monkeypatch.chdir(tmp_path)
    return tmp_path


def squeezed(text):
    return " ".join(text.split())


def files(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


@pytest.mark.parametrize("story", STORIES)
def test_what_is_typed_is_done_or_refused(story, call, here):
    for typed, *said in STORIES[story]:
        words, before = shlex.split(typed), files(here)
        code = said.pop(0) if said and isinstance(said[0], int) else 0
        if words[0] in {"cat", "edit"}:
            text = Path(words[1]).read_text("utf-8")
            if words[0] == "edit":
                Path(words[1]).write_text(text.replace(*words[2:]), "utf-8")
        else:
            done = call(*words, code=code)
            text = done.out + done.err
        assert not code or (done.out, files(here)) == ("", before)
        for each in said:
            absent = each.startswith("not: ")
            seen = squeezed(each.removeprefix("not: ")) in squeezed(text)
            assert seen is not absent, (typed, each, text)
