"""Sections of a report beside the summary, for the page and the terminal alike."""

from __future__ import annotations

from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING, Any

from rig.measurands import MEASURANDS, averaged, told
from rig.report.bars import bar
from rig.report.columns import Column, Mean, fine, mean_columns, summary_columns
from rig.report.finding import raised
from rig.report.numbers import degrees, fixed, plus_minus

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from rig.analysis.pairs import Effects
    from rig.analysis.result import Measured
    from rig.analysis.summary import GateMeans, Incline
    from rig.measurands import Measurand
    from rig.report.bars import Bars


@dataclass(frozen=True, slots=True)
class Part:
    """A heading, sentences or bullets, and perhaps a table."""

    heading: str
    sentences: Sequence[str] = ()
    columns: Sequence[Column[Any]] = ()
    records: Sequence[Any] = ()
    bullets: bool = False


def effects_parts(effects: Sequence[Effects]) -> Iterator[Part]:
    """Yield the section on effects of chains and sides where there are any."""
    if effects:
        first, second = effects[0].first, effects[0].second
        yield Part(
            f"Differences: chain {first} − chain {second}, and sides",
            [
                f"Paired differences over blocks of {first}, {second}, {second}, {first}: the "
                f"value when {first} strikes minus that when {second} strikes. A release skew that "
                "stays when the chains change places belongs to the sides; it is positive where "
                "the free side releases later."
            ],
            tuple(_effect_columns()),
            effects,
        )


def means_parts(summary: Sequence[Incline]) -> list[Part]:
    """Return the means of each measurand beside the model."""
    words = (
        "Eₙ is the difference from the prediction over the expanded uncertainty of that "
        "difference, the scatter of single falls included: within ±1 they agree (ISO 13528)."
    )
    return [
        Part(raised(f"{row.title} {row.symbol}"), [words], summary_columns(row), lines)
        for row in averaged()
        if (lines := [line for line in summary if row.name in line.means])
    ]


def budget_part(summary: Sequence[Incline]) -> Iterator[Part]:
    """Yield the table of what makes the uncertainty of the means, where anything is known of it."""
    lines = [
        Mean(line, row)
        for row in averaged()
        for line in summary
        if row.name in line.means and line.means[row.name].budget
    ]
    if lines:
        words = "More runs reduce the first part, not the common one. U = k·u covers 95 %."
        yield Part("Uncertainty of the means", [words], _BUDGET, lines)


def _share(mean: Mean, name: str) -> str:
    return fine(mean.row, mean.line.means[mean.row.name].budget.get(name))


_BUDGET: tuple[Column[Mean], ...] = (
    Column("quantity", lambda mean: f"{mean.row.symbol} ({mean.row.fine})", numeric=False),
    *mean_columns(attrgetter("line")),
    Column("u, runs / √n", lambda mean: _share(mean, "runs")),
    Column("u, common", lambda mean: _share(mean, "common")),
    Column("u", lambda mean: fine(mean.row, mean.line.means[mean.row.name].u)),
    Column("U", lambda mean: fine(mean.row, mean.line.means[mean.row.name].expanded)),
    Column(
        "largest common sources",
        lambda mean: ", ".join(list(mean.line.causes.get(mean.row.name, ()))[:2]),
        numeric=False,
    ),
)
_GATES: tuple[Column[GateMeans], ...] = (
    Column("channel", lambda one: str(one.mean.channel)),
    Column("height (mm)", lambda one: fixed(one.mean.height_m * 1e3, 1)),
    Column("n", lambda one: str(one.n)),
    Column("speed ± U (m/s)", lambda one: plus_minus(one.mean.speed, 1.0)),
    Column("SD (mm/s)", lambda one: _scaled(one.speed_sd)),
    Column("time since previous gate ± U (ms)", lambda one: plus_minus(one.mean.interval, 1e3)),
    Column("SD (ms)", lambda one: _scaled(one.interval_sd)),
)


def gate_parts(summary: Sequence[Incline]) -> Iterator[Part]:
    """Yield the section on what each gate saw of one object, where there is one."""
    for line in summary:
        if line.gates:
            caption = "Speed and time as the object's middle passes each beam: means of the runs."
            yield Part("Gate by gate", [caption], _GATES, line.gates)


def _scaled(value: float | None) -> str:
    return "" if value is None else fixed(value * 1e3, 3)


def _effect_columns() -> Iterator[Column[Effects]]:
    yield Column("incline (°)", lambda one: degrees(one.incline_deg))
    yield Column("blocks", lambda one: str(one.blocks))
    for row in told():
        if row.by_chain:
            yield _effect(row.symbol, row, lambda one: one.chain)
    for row in told():
        if row.by_side:
            yield _effect(f"sides' {row.symbol}", row, lambda one: one.side)


def _effect(
    what: str, row: Measurand, of: Callable[[Effects], Mapping[str, Measured]]
) -> Column[Effects]:
    return Column(
        f"{what} ± U ({row.fine})", lambda one: plus_minus(of(one).get(row.name), row.fine_scale)
    )


def scatter_part(summary: Sequence[Incline]) -> Part:
    """Make the table of scatter."""
    return Part(
        "Scatter of the runs",
        [
            "SD: standard deviation of one run. SE: standard error of the mean, by scatter alone. "
            "u and U95: standard and expanded uncertainty of the mean, with the errors that all "
            "runs share. SD/2: half of SD, as in the bars of Pantaleone's figures."
        ],
        tuple(_scatter_columns()),
        [Mean(line, row) for line in summary for row in averaged() if row.name in line.means],
    )


def _scatter_columns() -> Iterator[Column[Mean]]:
    yield from mean_columns(attrgetter("line"))
    yield Column("", lambda mean: f"{mean.row.symbol} ({mean.row.fine})", numeric=False)
    yield Column("mean", lambda mean: fine(mean.row, mean.line.means[mean.row.name].value))
    for heading, kind in _BARS.items():
        yield _bar_column(heading, kind)


def _bar_column(heading: str, kind: Bars) -> Column[Mean]:
    return Column(heading, lambda mean: fine(mean.row, bar(mean.line, mean.row.name, kind)))


_BARS: dict[str, Bars] = {"SD": "SD", "SE": "SE", "u": "u", "U95": "U95", "SD/2": "half-SD"}

_MOVES: tuple[Column[Mapping[str, Any]], ...] = (
    Column("prior", lambda row: str(row["prior"]), numeric=False),
    Column("incline (°)", lambda row: degrees(row["incline_deg"])),
    Column("strikes", lambda row: str(row.get("impact_chain", ""))),
    Column("quantity", lambda row: _fine(row)[0], numeric=False),
    Column("3× wider", lambda row: _fine(row)[1]),
    Column("3× narrower", lambda row: _fine(row)[2]),
    Column("U wider", lambda row: f"× {row['U95_ratio_wider']:.2f}"),
    Column("U narrower", lambda row: f"× {row['U95_ratio_narrower']:.2f}"),
)


def prior_part(moves: Sequence[Mapping[str, Any]]) -> Part:
    """Make the table of what means move by with each prior, see `rig analyze --priors`."""
    return Part(
        "Effect of each prior on the means",
        ["Changes of the means when one prior becomes three times wider, or narrower."],
        _MOVES,
        [*moves],
    )


def _fine(row: Mapping[str, Any]) -> tuple[str, str, str]:
    """Quantity with its unit, and both moves in it."""
    one = MEASURANDS[row["quantity"]]
    wider, narrower = (fine(one, row[word]) for word in ("wider", "narrower"))
    return f"{one.symbol} ({one.fine})", wider, narrower
