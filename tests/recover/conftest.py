"""Drops of a fence to damage."""

from tests.cli.conftest import fences  # noqa: F401 - a fixture
