"""``rig analyze``."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from rig.analysis.video import VideoFall, video_fall
from rig.cache.entry import recall
from rig.commands.output import print_results, progress, show
from rig.errors import InputError
from rig.measurands import acceleration_in
from rig.reasons import make_error
from rig.report.numbers import plus_minus
from rig.report.parts import scatter_parts, tables
from rig.report.templates import lines
from rig.results import SessionResults, complete_analysis, results
from rig.session.store import Session
from rig.timers.video import read_video

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator

    from rig.analysis.result import Measured


_SINGLE = {"budget": None, "video": None, "session_trials": None, "priors": False, "scatter": False}
_SEVERAL = {"same_rig": None, "unfinished": False}
"""Options of one session only, and of several, with what they are when they are not used."""


def main(arguments: Namespace) -> int:
    """Compute the results of a session, or of several together."""
    refusal, unused = "option_for_several_sessions", _SEVERAL
    if arguments.further:
        refusal, unused = "option_for_one_session", _SINGLE
    if misplaced := [name for name in unused if getattr(arguments, name) != unused[name]]:
        options = ", ".join(f"--{name.replace('_', '-')}" for name in misplaced)
        raise make_error(InputError, refusal, options=options)
    if arguments.further:
        from rig.commands.compare import analyze_together  # noqa: PLC0415 - likewise

        return analyze_together(arguments)
    if arguments.budget is not None:
        from rig.commands import budget  # noqa: PLC0415 - only when it is asked for

        return budget.main(arguments)
    track = None if arguments.video is None else read_video(arguments.video)
    with Session.open(arguments.session, readonly=True) as session:
        deep = arguments.priors or arguments.session_trials is not None
        outcome = results(session, progress, fresh=arguments.fresh, with_joint_fit=deep)
        members = _by_joint_fit(arguments, session, outcome) if deep else {}
    video = None if track is None else video_fall(*track)
    if video is not None and not outcome.blind:
        members["video"] = video.json(_by_gates(outcome))
    code = print_results(outcome, as_json=arguments.json, **members)
    if not arguments.json:
        summary = outcome.analysis.summary
        asked = [*scatter_parts(summary)] if arguments.scatter else []
        asked += tables("priors", members["prior_sensitivity"]) if arguments.priors else ()
        asked += tables("gates", (gate for line in summary for gate in line.gates))
        asked += tables("effects", outcome.analysis.effects)
        for part in asked:
            show(["", part.heading, *part.table])
        if video is not None and "video" in members:
            show(["", *_video_lines(video, _by_gates(outcome))])
        if "monte_carlo" in members:
            show(["", *lines("trials", members["monte_carlo"])])
    return code


def _by_joint_fit(
    arguments: Namespace, session: Session, outcome: SessionResults
) -> dict[str, Any]:
    """Compute what takes the joint fit, and its time."""
    members: dict[str, Any] = {}
    trials = arguments.session_trials
    analysis = cache(lambda: complete_analysis(session, outcome, progress))
    if trials is not None:
        from rig.commands.budget import session_trials  # noqa: PLC0415 - only when it is asked for

        members["monte_carlo"] = recall(
            dict,
            lambda: session_trials(analysis(), trials),
            *("session trials", outcome.digest, trials),
            fresh=arguments.fresh,
        )
    if arguments.priors:
        from rig.analysis.sensitivity import prior_sensitivity  # noqa: PLC0415 - likewise

        make, fresh = lambda: prior_sensitivity(analysis()), arguments.fresh
        members["prior_sensitivity"] = recall(list, make, "priors", outcome.digest, fresh=fresh)
    return members


def _by_gates(outcome: SessionResults) -> Measured | None:
    """Acceleration that the gates found: of what only falls, or of the free chain."""
    for line in outcome.analysis.summary:
        row = acceleration_in(line.means)
        if row is not None:
            return line.means[row.name]
    return None if outcome.gravity is None else outcome.gravity.measured


def _video_lines(video: VideoFall, gates: Measured | None) -> Iterator[str]:
    yield f"acceleration by {video.frames} frames of a video: {_write(video.acceleration)}"
    if gates is not None:
        error = video.beside(gates)
        word = (
            "they agree" if abs(error) <= 1.0 else "they disagree: the video's scale, or its frames"
        )
        yield f"by the gates: {_write(gates)}; Eₙ {error:+.2f}, {word}"
    if video.bent:
        yield "the frames follow no parabola: cut those before the release and after the end"
    yield "± is what the frames' scatter allows, without how well the video's lengths are scaled"


def _write(value: Measured) -> str:
    return f"{plus_minus(value, 1.0, 3)} m/s²"
