"""What many tests work out again of the same file is worked out once, for who asks for that."""

import hashlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from filelock import FileLock


def filled_once(
    temporary: pytest.TempPathFactory, name: str, fill: Callable[[Path], object]
) -> Path:
    """Return a folder that is filled by the first worker of a run to ask for it."""
    place = temporary.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        place = place.parent
    folder = place / name
    with FileLock(place / f"{name}.lock"):
        if not folder.exists():
            folder.mkdir()
            fill(folder)
            (folder / "whole").touch()
    assert (folder / "whole").exists(), f"{name}: what the first worker says of it"
    return folder


@pytest.fixture(scope="session")
def loops_compiled(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Have one worker compile the resolved world's loops, which takes as long as a hundred tests.

    In a new clone each worker would begin to, for what another one compiles is kept at its end.
    """

    def fill(_: Path) -> None:
        from sim.resolved.fall import fall
        from tests.sim.test_resolved import SCENES

        fall(SCENES[0], step=1e-5, after=1e-3)

    filled_once(tmp_path_factory, "loops compiled", fill)


def once(work: Callable) -> Callable:
    """Make a function that remembers what `work` returned, and of what."""
    returned = {}

    def remembered(*arguments):
        name = hashlib.sha256(repr(arguments).encode()).digest()
        if name not in returned:
            returned[name] = work(*arguments)
        return returned[name]

    return remembered


@pytest.fixture(scope="module")
def analysed_once(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Have the tests of a module share kept results, and the trial drops that they only show."""
    from rig.commands import design
    from rig.design.trials import trials

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("shared")))
        trial_drops = once(trials)
        patch.setattr("rig.design.trials.trials", trial_drops)
        patch.setattr(design, "trials", trial_drops)
        yield
