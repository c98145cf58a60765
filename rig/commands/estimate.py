"""``rig estimate``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rig.analysis.likeness import likeness
from rig.commands.output import print_json, progress, say, tell_damage
from rig.estimate.session import estimate
from rig.files import make_folder, write_atomic
from rig.report.estimate import estimate_text
from rig.results import detailed, protocol_of
from rig.sections import Sections
from rig.session.store import Session

if TYPE_CHECKING:
    from argparse import Namespace


def main(arguments: Namespace) -> int:
    """Estimate the parameters of the impacts from a session."""
    with Session.open(arguments.session, readonly=True) as session:
        folder = None if arguments.output is None else make_folder(arguments.output)
        analysis, _ = detailed(session, progress("analysing run"))
        found = estimate(protocol_of(session), analysis)
        simulated = session.simulated
    like = None if analysis.joint is None else likeness(analysis.joint)
    sections = Sections()
    if arguments.json:
        said: dict[str, Any] = {"simulated": simulated, **found.json()}
        print_json(said if like is None else said | {"likeness": like.json()})
    else:
        if like is not None and not like.like:
            print(like.sentence)
        print(estimate_text(found, sections, simulated=simulated))
    if folder is not None:
        from rig.report.estimate_pictures import estimate_pictures  # noqa: PLC0415 - only drawn here

        drawn = estimate_pictures(found, sections, simulated=simulated)
        for name, picture in drawn.items():
            write_atomic(folder / f"{name}.svg", picture.svg)
            say(f"{folder / name}.svg")
    for sentence in sections.failed.values():
        say(sentence)
    return tell_damage(analysis)
