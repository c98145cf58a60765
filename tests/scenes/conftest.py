"""A journey through all commands analyses its session once."""

from __future__ import annotations

import pytest

from tests.once import analysed_once  # noqa: F401 - a fixture


@pytest.fixture(autouse=True)
def _once(analysed_once: None) -> None:  # noqa: F811
    pass
