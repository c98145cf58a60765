"""A rig of real processes for each test."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from rig.bench.stand import Stand

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rig.daemon.client import Client


@pytest.fixture
def stand() -> Iterator[Stand]:
    """Have a board and a daemon for a protocol of two runs."""
    with Stand(runs=2, seed=3) as made:
        made.start_daemon()
        yield made


@pytest.fixture
def client(stand: Stand) -> Iterator[Callable[[str], Client]]:
    """Connect clients that are gone at the end of the test."""
    made: list[Client] = []

    def connect(name: str) -> Client:
        made.append(stand.client(name))
        return made[-1]

    yield connect
    for one in made:
        one.close()
