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
    """Make a function that remembers what `work` returned last, and of what; no key, no memory."""
    last = {}

    def remembered(*arguments):
        name = key(*arguments)
        if name is None:
            return work(*arguments)
        if name not in last:
            last.clear()
            last[name] = arguments, work(*arguments)
        return last[name][1]

    return remembered


def _file(session, protocol, progress=None, known=None):
    """A file as it is; of what `run` and `replay` know otherwise, nothing is taken or kept."""
    if known is not None or not isinstance(session, Session):
        return None
    at = session.path.stat()
    return session.path, at.st_mtime_ns, at.st_size


@pytest.fixture(scope="module")
def analysed_once() -> Iterator[None]:
    """Have the tests of a module share what they only show."""
    with pytest.MonkeyPatch.context() as patch:
        trial_drops = once(trials, repr)
        patch.setattr("rig.design.trials.trials", trial_drops)
        patch.setattr(design, "trials", trial_drops)
        patch.setattr(whole, "_analysed", once(ANALYSE, _file))
        session_estimate = once(estimate, lambda _, analysis: id(analysis))
        for command in (estimates, report):
            patch.setattr(command, "estimate", session_estimate)
        yield
