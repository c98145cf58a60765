"""Lab-rig controller for falling-chain and photogate experiments.

The Python door, for scripts and notebooks: `open` a session, `read_protocol`, `predict`. Nothing
behind it is loaded before it is used; `rig.door` has its documentation.
"""

__version__ = "0.1.0"
__all__ = ["__version__", "open", "predict", "read_protocol"]


def __getattr__(name: str) -> object:
    """Load the door when somebody comes to it."""
    if name not in __all__:
        raise AttributeError(f"module 'rig' has no attribute {name!r}; it offers {__all__}")
    from importlib import import_module  # noqa: PLC0415 - `rig --help` needs none of this

    return getattr(import_module("rig.door"), name)


def __dir__() -> list[str]:
    return __all__
