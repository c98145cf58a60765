"""What many commands work out again of the same file is worked out once, for who asks for that."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from rig.commands import design, report
from rig.commands import estimate as estimates
from rig.design.trials import trials
from rig.estimate.session import estimate
from rig.results import whole
from rig.session.store import Session

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

ANALYSE = whole._analysed


def once(work: Callable, key: Callable) -> Callable:
    """Make a function that remembers what `work` returned, and of what; no key, no memory."""
    known = {}

    def remembered(*arguments):
        name = key(*arguments)
        if name is None:
            return work(*arguments)
        if name not in known:
            known[name] = arguments, work(*arguments)
        return known[name][1]

    return remembered


def _file(session, protocol, progress=None, known=None):
    """A file as it is; of what `run` and `replay` know otherwise, nothing is taken or kept."""
    if known is not None or not isinstance(session, Session):
        return None
    at = session.path.stat()
    return session.path, at.st_mtime_ns, at.st_size


def _remember(patch: pytest.MonkeyPatch) -> None:
    trial_drops = once(trials, repr)
    patch.setattr("rig.design.trials.trials", trial_drops)
    patch.setattr(design, "trials", trial_drops)
    patch.setattr(whole, "_analysed", once(ANALYSE, _file))
    session_estimate = once(estimate, lambda _, analysis: id(analysis))
    for command in (estimates, report):
        patch.setattr(command, "estimate", session_estimate)


@pytest.fixture
def analysed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Remember for a test."""
    _remember(monkeypatch)


@pytest.fixture(scope="module")
def analysed_once_for_all() -> Iterator[None]:
    """Remember for a module, the tests of which only show what is found."""
    with pytest.MonkeyPatch.context() as patch:
        _remember(patch)
        yield
