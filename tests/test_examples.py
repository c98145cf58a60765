"""What `./run test` tries is the same every time."""

from __future__ import annotations

from importlib import import_module

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st


def tried() -> list[int]:
    seen = []

    @given(st.integers())
    def look(number: int) -> None:
        seen.append(number)

    look()
    return seen


@pytest.mark.skipif(not settings().derandomize, reason="a search tries others every time")
def test_examples_do_not_depend_on_what_ran_before(tmp_path, monkeypatch):
    before = tried()
    source = "\n".join(f"N{n} = {n * 7919 + 10**9}" for n in range(400))
    (tmp_path / "numbers_to_try.py").write_text(source)
    monkeypatch.syspath_prepend(tmp_path)
    import_module("numbers_to_try")
    assert tried() == before
