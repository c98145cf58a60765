"""``rig estimate``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rig.cache.entry import CacheEntry
from rig.commands.output import print_json, progress, say, tell_damage
from rig.files import make_folder, write_atomic
from rig.report.estimate import estimate_text
from rig.results import check_open, protocol_of, results
from rig.results.estimated import session_estimate
from rig.sections import Sections
from rig.session.store import Session

if TYPE_CHECKING:
    from argparse import Namespace


def main(arguments: Namespace) -> int:
    """Estimate the parameters of the impacts from a session."""
    with Session.open(arguments.session, readonly=True) as session:
        folder = None if arguments.output is None else make_folder(arguments.output)
        check_open(session, protocol_of(session))
        show, fresh = progress("analysing run"), arguments.fresh
        whole = results(session, show, fresh=fresh, with_joint_fit=True)
        found = session_estimate(session, whole, show, fresh=fresh)
    analysis, simulated = whole.analysis, whole.simulated
    like = None if analysis.rig is None else analysis.rig.likeness
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

        kept = CacheEntry(dict, "estimate pictures", whole.digest, fresh=fresh)
        drawn = kept.find()
        if drawn is None:
            drawn = estimate_pictures(found, sections, simulated=simulated)
            drawn = drawn if sections.failed or found.failed else kept.keep(drawn)
        for name, picture in drawn.items():
            write_atomic(folder / f"{name}.svg", picture.svg)
            say(f"{folder / name}.svg")
    for sentence in sections.failed.values():
        say(sentence)
    return tell_damage(analysis)
