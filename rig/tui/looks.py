"""Symbol and colour of every state of a run, and the verdict in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.content import Content

from rig.analysis.result import GOOD
from rig.reasons import remedies
from rig.tui.widgets.text import plain

if TYPE_CHECKING:
    from rig.tui.model import Model

LOOKS = {
    "accepted": ("✓", "$success"),
    "marginal": ("~", "$warning"),
    "void": ("✗", "$error"),
    "rejected": ("⊘", "$error"),
    "recorded": ("…", "$primary"),
    "armed": ("!", "$warning"),
    "fired": ("↓", "$primary"),
    "interrupted": ("■", "$warning"),
    "planned": ("·", "$foreground 70%"),
}
_REMEDIES = 2
"""Things to do that are shown: what else is wrong shows when these are mended."""


def verdict_words(model: Model) -> Content:
    """Write the verdict and its reasons."""
    if model.job is None:
        return Content(model.loading or "No drop yet.")
    verdict, reasons = model.verdict
    if not verdict:
        return Content(model.loading or "no verdict yet")
    symbol, colour = LOOKS.get(verdict, ("?", "$foreground"))
    lines = [Content.styled(f" {symbol} {verdict.upper()} ", f"bold $background on {colour}")]
    lines += [Content.assemble("  ", (plain(reason, 200), "")) for reason in reasons[:4]]
    if len(reasons) > 4:
        lines.append(Content(f"  and {len(reasons) - 4} more reasons, in the session file"))
    replaced = model.replaced
    if verdict not in GOOD and replaced is not None:
        lines += [
            Content(f"  Only the latest attempt counts: attempt {replaced.attempt} was good, "
                    f"but run {model.job.run} has no result now."),
            Content("  → press a to repeat it before you change anything at the rig"),
        ]  # fmt: skip
    if model.blind:
        lines.append(Content("  BLIND: results are hidden until you unblind the session"))
    if verdict == "void":
        lines += [Content(f"  → {remedy}") for remedy in remedies(reasons)[:_REMEDIES]]
    return Content("\n").join(lines)
