"""Sections that fail alone: one that cannot be made is named, and takes no other along."""

from collections.abc import Iterator
from contextlib import contextmanager

from rig.errors import RigError


class Sections:
    """Makes the sections of one result.

    Attributes
    ----------
    failed
        A sentence for each section that could not be made, by the section's name.
    """

    def __init__(self) -> None:
        self.failed: dict[str, str] = {}

    @contextmanager
    def alone(self, name: str) -> Iterator[None]:
        """Make one section in the block; where that fails, leave a sentence in `failed`.

        Parameters
        ----------
        name
            What stands before "could not be made".

        Raises
        ------
        ImportError, RigError
            A package is not installed: every section would lack it, and the user can help that.
        """
        try:
            yield
        except Exception as error:
            if any(isinstance(part, ImportError) for part in (error, error.__cause__)):
                raise
            # A mistake in the program is to be seen for what it is.
            why = (
                error.message if isinstance(error, RigError) else f"{type(error).__name__}: {error}"
            )
            self.failed[name] = f"{name} could not be made: {' '.join(why.split())}"
