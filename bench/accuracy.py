"""``./run bench accuracy``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bench.studies.accuracy import accuracy
from bench.studies.fast_accuracy import BLOCK, DOUBLED, STACK, doubled, fast_accuracy
from bench.workers import results
from rig.commands.output import print_found, say, write_page
from rig.files import make_folder
from rig.measurands import MEASURANDS
from rig.text_table import text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator, Mapping

    from rig.measurands import Measurand

SESSIONS = 5
"""Of the whole protocol, through the whole stack."""
RIGS = 260
"""Short sessions for each dial: with 4 drops each, more than a thousand."""

_HEAD = """\
# Errors in the model's world

`./run bench accuracy`: simulated sessions through board, line and file, compared with the true
values. *In U95*: how often ± U holds the true value (95 % is intended). *rms / u*: rms error over
the stated standard uncertainty."""


def main(arguments: Namespace) -> int:
    """Measure accuracy over several simulated sessions."""
    found = _acceptance(arguments) if arguments.doubled else _stack(arguments, arguments.port)
    lines = _table(found["default"] if arguments.doubled else found)
    if arguments.doubled:
        lines += ["", *acceptance_table(found)]
    if arguments.output is not None:
        write_page(make_folder(arguments.output), "accuracy", _HEAD, lines)
    print_found(found, lambda: "\n".join(lines), as_json=arguments.json)
    return 0


def _stack(arguments: Namespace, port: str, repeats: int | None = None) -> dict[str, Any]:
    """Run sessions through device, line, daemon and file."""
    seeds = arguments.seeds or SESSIONS
    return accuracy(arguments.protocol, port, seeds, say, repeats or arguments.repeats)


def _acceptance(arguments: Namespace) -> dict[str, Any]:
    """Measure with each dial of the simulation doubled, many rigs each, several at a time."""
    rigs = arguments.seeds or RIGS
    protocol = arguments.protocol
    ports = {dial: doubled(arguments.port, dial) for dial in DOUBLED}
    ports = {"default": arguments.port} | ports
    calls: dict[str, tuple[Any, ...]] = {
        dial: (fast_accuracy, protocol, port, rigs)
        for dial, port in ports.items()
        if dial not in STACK
    }
    calls |= {
        f"{dial}, whole stack": (accuracy, protocol, ports[dial], 1, say, BLOCK)
        for dial in ("default", *STACK)
    }
    found = {}
    for name, case in zip(calls, results([*calls.values()], arguments.jobs), strict=True):
        found[name] = case
        say(f"{name}: {sum(case['verdicts'].values())} drops")
    return found


def _table(found: Mapping[str, Any]) -> list[str]:
    verdicts = ", ".join(f"{n} {verdict}" for verdict, n in found["verdicts"].items())
    lines = [
        f"{found['sessions']} simulated sessions, drops: {verdicts}",
        f"{found['edges_matched']} edges matched, {found['edges_given_to_a_wrong_rod']} to a wrong "
        f"rod, {found['strays_taken_for_a_rod']} strays taken for a rod",
    ]
    rows = [["error of one run", "rms", "bias", "worst", "mean U95", "bias/U", "in U95", "rms / u"]]
    for name, errors in found["quantities"].items():
        row = MEASURANDS[name]
        held = f"{errors['coverage']:.1%}"
        if "coverage_se" in errors:
            held += f" ± {errors['coverage_se']:.1%}"
        sizes = _sizes(errors, row, "rms", "bias", "worst", "mean_U95")
        bias, bound = f"{errors['bias_over_U']:.2f}", f"{errors['times_u']:.2f}"
        rows.append([f"{row.label} ({row.fine})", *sizes, bias, held, bound])
    for baseline, label in (("camera_480_fps", "camera"), ("two_gate_timer", "two-gate timer")):
        for name, errors in found.get(baseline, {}).items():
            row = MEASURANDS[name]
            sizes = _sizes(errors, row, "rms", "bias", "worst")
            rows.append([f"{label} {row.symbol} ({row.fine})", *sizes, *[""] * 4])
    lines += text_table(rows, left={0})
    own = found["analysis_ms_per_run"]
    plain = found.get("plain_fit_ms_per_run")
    ratio = f", {own / plain:.0f} times a plain least-squares fit" if plain else ""
    lines.append(f"analysis of a run with learning: {own:.0f} ms of processor time{ratio}")
    times = sorted(found["wall_time_s"])
    lines.append(f"wall time of a session: median {times[len(times) // 2]:.1f} s")
    return lines


def _sizes(errors: Mapping[str, float], row: Measurand, *names: str) -> list[str]:
    return [f"{errors[name] * row.fine_scale:.3f}" for name in names]


LIMITS = {
    "separation_m": ("Δz", "mm", 1e3, 0.5e-3),
    "speed_m_s": ("V", "%", 1e2, 3e-3),
    "release_skew_s": ("skew", "ms", 1e3, 0.1e-3),
}
"""Quantity → name, unit, factor, largest rms error of one run; of V relative."""
BIAS = 0.1
"""Largest bias of the mean, in units of the mean U95 of one run."""
COVERAGE = (0.93, 0.97)
"""Share of the truths that 95 % intervals should hold."""
_SURE = 2.0  # standard errors: what differs by less may be chance
_NAMES = {
    "separation_m": "Δz",
    "separation_raw_m": "raw",
    "release_skew_s": "skew",
    "speed_m_s": "V",
    "fall_time_s": "time",
}


def failures(found: Mapping[str, Any]) -> Iterator[str]:
    """Say what of one case is beyond a limit, by more than chance.

    Parameters
    ----------
    found
        As `bench.studies.accuracy.AccuracyTally.json` gives it.
    """
    if found["edges_given_to_a_wrong_rod"]:
        yield f"{found['edges_given_to_a_wrong_rod']} edges given to a wrong rod"
    for name, errors in found["quantities"].items():
        label = _NAMES.get(name, name)
        if name in LIMITS and _rms(found, name) > LIMITS[name][3]:
            yield f"rms error of {label}"
        if "coverage_se" not in errors:
            continue  # one rig tells nothing of intervals: its drops share their errors
        sure = _SURE * errors["bias_se"] / errors["mean_U95"]
        if abs(errors["bias_over_U"]) - sure > BIAS:
            yield f"bias of {label} is {errors['bias_over_U']:.2f} U"
        low, high = COVERAGE
        sure = _SURE * errors["coverage_se"]
        if not low - sure <= errors["coverage"] <= high + sure:
            yield f"coverage of {label} is {errors['coverage']:.1%}"


def acceptance_table(cases: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """One line a case: rms errors, the largest bias, coverage by quantity, and what fails."""
    names = [name for name in _NAMES if name in next(iter(cases.values()))["quantities"]]
    limits = [name for name in LIMITS if name in names]
    head = "".join(f"{'{} ({})'.format(*LIMITS[name][:2]):>11}" for name in limits)
    lines = [
        f"{'doubled':<22}{'runs':>5}{'void':>6}{head}{'bias/U':>8}"
        f"{'  in U95 (%): ' + ', '.join(_NAMES[name] for name in names):<42}  wrong",
    ]
    for case, found in cases.items():
        verdicts, errors = found["verdicts"], found["quantities"]
        rms = "".join(f"{_rms(found, name) * LIMITS[name][2]:11.4f}" for name in limits)
        bias = max((one["bias_over_U"] for one in errors.values()), key=abs)
        held = " ".join(f"{100 * errors[name]['coverage']:6.1f}" for name in names)
        lines.append(
            f"{case:<22}{sum(verdicts.values()):5d}{verdicts.get('void', 0):6d}{rms}{bias:8.2f}"
            f"  {held:<40}  {found['edges_given_to_a_wrong_rod']:5d}"
        )
    for case, found in cases.items():
        lines += [f"{case}: {failure}" for failure in failures(found)]
    return lines


def _rms(found: Mapping[str, Any], name: str) -> float:
    """Rms error, of V relative to it."""
    if name == "speed_m_s":
        return float(found["speed_rms_relative"])
    return float(found["quantities"][name]["rms"])
