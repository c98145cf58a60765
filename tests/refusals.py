"""What is refused: by which error, and in which words."""

from collections.abc import Callable
from typing import TypeVar

import pytest

Error = TypeVar("Error", bound=BaseException)


def refused(kind: type[Error], words: str, work: Callable, *arguments: object, **options) -> Error:
    """See that work ends with an error of this kind, in words as `re.search` finds them."""
    __tracebackhide__ = True
    with pytest.raises(kind, match=words) as caught:
        work(*arguments, **options)
    return caught.value
