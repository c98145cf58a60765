"""A client's copy of the daemon's state, as API.md describes it; without any I/O."""

from typing import Any


class Replica:
    """The copy.

    Attributes
    ----------
    n
        Number of the last change that is in it.
    state
        Sections by name.
    """

    def __init__(self) -> None:
        self.n = 0
        self.state: dict[str, Any] = {}

    def follow(self, method: str, params: dict[str, Any]) -> None:
        """Take a notification: a whole state, or a change.

        Raises
        ------
        ValueError
            A change is missing before it: the daemon never leaves one out.
        """
        if method == "snapshot":
            self.n, self.state = params["n"], params["state"]
        if method != "change":
            return
        if params["n"] != self.n + 1:
            raise ValueError(f"change {params['n']} behind {self.n}")
        self.n = params["n"]
        self.state |= params.get("set", {})
        if runs := {run["run"]: run for run in params.get("runs", [])}:
            self.state["runs"] = [runs.get(run["run"], run) for run in self.state["runs"]]
        self.state["edges"] += params.get("edges", [])
