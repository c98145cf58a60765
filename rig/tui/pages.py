"""The pages by name, loaded when they are wanted: the first paint needs one of them."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.tui.screens.page import Page

NAMES = ("protocol", "device", "run", "result", "session", "history")


def load(name: str) -> type[Page]:
    """Return a page's class; safe in any thread."""
    module = import_module(f"rig.tui.screens.{name}")
    kind: type[Page] = getattr(module, f"{name.title()}Page")
    return kind


def load_rest() -> None:
    """Load what the first session will need."""
    for module in ("rig.runner", "rig.results.live"):
        import_module(module)
