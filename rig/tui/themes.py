"""Colours: dark, light, and the two extremes only."""

from __future__ import annotations

from textual.theme import Theme

THEMES = (
    Theme(
        name="rig-dark",
        primary="#5aa9e6",
        secondary="#f2a65a",
        accent="#c3a6ff",
        success="#6fcf97",
        warning="#f2c94c",
        error="#ff6b6b",
        foreground="#dfe6ee",
        background="#10151c",
        surface="#161d27",
        panel="#1e2733",
        dark=True,
        variables={"border": "#33465c", "border-blurred": "#33465c"},
    ),
    Theme(
        name="rig-light",
        primary="#0b5cad",
        secondary="#a8480c",
        accent="#6a3fb5",
        success="#1b6e3c",
        warning="#7a5900",
        error="#b3161d",
        foreground="#1b232c",
        background="#fbfaf7",
        surface="#f3f1ec",
        panel="#e6e3dc",
        dark=False,
        variables={"border": "#9aa5b1", "border-blurred": "#9aa5b1"},
    ),
    Theme(
        name="rig-contrast",
        primary="#00ffff",
        secondary="#ffff00",
        accent="#ffffff",
        success="#00ff00",
        warning="#ffff00",
        error="#ff9d9d",
        foreground="#ffffff",
        background="#000000",
        surface="#000000",
        panel="#000000",
        dark=True,
        variables={"border": "#ffffff", "border-blurred": "#ffffff"},
    ),
)
NAMES = tuple(theme.name for theme in THEMES)


def after(name: str) -> str:
    """Name the theme after this one."""
    return NAMES[(NAMES.index(name) + 1) % len(NAMES)] if name in NAMES else NAMES[0]
