"""Whether every accuracy is as promised, with the dials as they are and each one doubled."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

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
        As `rig.bench.accuracy.AccuracyTally.json` gives it.
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
