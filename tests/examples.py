"""How many examples a property is tried on."""

from hypothesis import settings


def examples(count: int, **more: object) -> settings:
    """That many in `./run test`, and in `./run bench search` as many times more as by default."""
    return settings(max_examples=count * settings().max_examples // 100, **more)
