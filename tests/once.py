"""What many tests work out again of the same file is worked out once, for who asks for that."""

from collections.abc import Callable, Iterator

import pytest

from rig.commands import design
from rig.design.trials import trials


def once(work: Callable) -> Callable:
    """Make a function that remembers what `work` returned last, and of what."""
    last = {}

    def remembered(*arguments):
        name = repr(arguments)
        if name not in last:
            last.clear()
            last[name] = work(*arguments)
        return last[name]

    return remembered


@pytest.fixture(scope="module")
def analysed_once(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Have the tests of a module share kept results, and the trial drops that they only show."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("shared")))
        trial_drops = once(trials)
        patch.setattr("rig.design.trials.trials", trial_drops)
        patch.setattr(design, "trials", trial_drops)
        yield
