"""Everything that is derived from a session file, and can be derived again at any time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rig.analysis.drop import TimeScale
from rig.analysis.session import analyze
from rig.link.clock import RESONATOR_TOLERANCE, tick_rate
from rig.protocol import reader
from rig.session.schema import RunState

if TYPE_CHECKING:
    from rig.analysis.session import Analysis, Progress
    from rig.protocol.scene import Protocol
    from rig.records import Drop, Ping
    from rig.session.reading import Reader

_APART_NS = 3600 * 10**9  # between two connections whose distance in time nobody knows
_UNKNOWN = RESONATOR_TOLERANCE / 3**0.5


@dataclass(frozen=True, slots=True)
class Calibration:
    """The time scale of a session.

    Attributes
    ----------
    device
        Of drops from the device; `None` where there was none.
    source
        In words.
    details
        For reports: numbers by name.
    timer_u
        Relative standard uncertainty of the time scale of imported edges.
    """

    device: TimeScale | None
    source: str
    details: dict[str, Any]
    timer_u: float = _UNKNOWN

    def scale(self, drop: Drop) -> TimeScale:
        """Time scale of one drop; edges from another timer keep that timer's."""
        if drop.certificate is None or self.device is None:
            return TimeScale(drop.tick_hz, self.timer_u)
        return self.device


def calibration(session: Reader) -> Calibration:
    """Calibrate a session's clock from everything it recorded."""
    identities = session.identities()
    nominal = next((one["tick_hz"] for _, one in identities if "tick_hz" in one), None)
    u = next((one["clock_u"] for _, one in identities if "clock_u" in one), _UNKNOWN)
    if nominal is None:
        return Calibration(
            None,
            "times as the file gives them",
            {"source": "times as the file gives them", "relative_u": u},
            u,
        )
    pings, boots_ns = _one_after_another(session.pings(), [ns for ns, _ in identities])
    rate = tick_rate(pings, nominal, boots_ns)
    source = (
        f"device against host clock, {rate.n} samples"
        if rate.n
        else "nominal tick rate: too few clock samples"
    )
    return Calibration(
        TimeScale(rate.hz, rate.u_hz / rate.hz),
        source,
        {
            "source": source,
            "tick_hz": rate.hz,
            "nominal_tick_hz": nominal,
            "error_ppm": (rate.hz / nominal - 1.0) * 1e6,
            "u_ppm": rate.u_hz / rate.hz * 1e6,
            "samples": rate.n,
            "span_s": rate.span_s,
        },
        u,
    )


def _one_after_another(pings: list[Ping], identities_ns: list[int]) -> tuple[list[Ping], list[int]]:
    """Put samples into one order of time where the host's clock began again in between.

    Also return when the device may have restarted: at each of those breaks, and wherever it said
    who it is. By which clock it said so is not known, so it is said by each.
    """
    found: list[Ping] = []
    boots_ns = list(identities_ns)
    shift = 0
    for ping in pings:
        if found and ping.host_send_ns + shift < found[-1].host_recv_ns:
            last_ns = found[-1].host_recv_ns
            shift = last_ns + _APART_NS - ping.host_send_ns
            # How far apart the two really are nobody knows: no line may go through both.
            boots_ns += [last_ns, *(ns + shift for ns in identities_ns)]
        found.append(
            ping._replace(
                host_send_ns=ping.host_send_ns + shift, host_recv_ns=ping.host_recv_ns + shift
            )
        )
    return found, boots_ns


def protocol_of(session: Reader) -> Protocol:
    """Read the protocol as the session keeps it."""
    return reader.parse(session.protocol_text, session.protocol_source)


def results(session: Reader, progress: Progress | None = None) -> dict[str, Any]:
    """Analyse a session: what `rig analyze --json` prints.

    Parameters
    ----------
    session
        Open, for reading at least.
    progress
        Called with the number of drops done and the number of all.
    """
    found, clock = detailed(session, progress)
    return {"simulated": session.simulated, "clock": clock.details} | found.json()


def detailed(session: Reader, progress: Progress | None = None) -> tuple[Analysis, Calibration]:
    """Analyse a session and keep everything, each edge's rod too."""
    clock = calibration(session)
    found = analyze(
        protocol_of(session), list(session.drops()), clock.scale, rejected(session), progress
    )
    return found, clock


def rejected(session: Reader) -> dict[tuple[int, int], tuple[str, ...]]:
    """Drops whose last state is that the operator rejected them, with the causes."""
    last = {(entry.run, entry.attempt): entry for entry in session.states()}
    return {key: entry.reasons for key, entry in last.items() if entry.state is RunState.REJECTED}


def tick_rates(session: Reader) -> dict[int, float]:
    """Calibrated tick rate of each run's latest drop, Hz."""
    clock = calibration(session)
    return {drop.run: clock.scale(drop).hz for drop in session.latest_drops()}
