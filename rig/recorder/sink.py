"""Where a recorder of a device without a session writes: nowhere."""

from __future__ import annotations

from typing import Any

_FORGOTTEN = ("log_bytes", "add_identity", "add_timing", "drop", "commit")


class NullSink:
    """What a recorder uses of a session. Nothing is kept: it watches, and never arms.

    It has no `add_drop` and no `add_state`: a drop is never forgotten, and a run belongs to a
    session.
    """

    def __getattr__(self, name: str) -> Any:
        if name not in _FORGOTTEN:
            raise AttributeError(name)
        return lambda *_args, **_names: None
