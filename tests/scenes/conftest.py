"""A journey through all commands analyses its session once."""

from tests.once import analysed_once  # noqa: F401 - a fixture
