"""What is refused: by which error, and in which words."""

from collections.abc import Callable
from typing import TypeVar

import pytest

Error = TypeVar("Error", bound=BaseException)


def refused(kind: type[Error], words: str, work: Callable, *arguments: object, **options) -> Error:
    """See that work ends with such an error, in words as `re.search` finds them or, "", in any."""
    __tracebackhide__ = True
    with pytest.raises(kind, match=words or None) as caught:
        work(*arguments, **options)
    return caught.value
