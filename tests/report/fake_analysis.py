"""A made-up but realistic analysis: the numbers of the reference table with scatter."""

import math
import random
from typing import Any

MODEL = {
    0.0: (0.0801755, 6.2857635),
    10.0: (0.0801755, 6.2857635),
    20.0: (0.0801755, 6.2857635),
    30.0: (0.1445578, 7.5511642),
    40.0: (0.1154681, 6.9327597),
    60.0: (0.0535856, 5.8609488),
    80.0: (0.0098142, 5.2579813),
}


def quantity(value: float, u: float) -> dict[str, float]:
    return {"value": value, "u": u, "U95": 2 * u}


def two_chains(seed: int = 1, repeats: int = 12) -> dict[str, Any]:
    rng = random.Random(seed)
    runs: list[dict[str, Any]] = []
    summary: list[dict[str, Any]] = []
    inclines = list(MODEL)
    rng.shuffle(inclines)
    for incline in inclines:
        separation, speed = MODEL[incline]
        values = []
        for repeat in range(repeats):
            number = len(runs) + 1
            skew = rng.gauss(0.0008, 0.002)
            dz = separation + 0.0008 + rng.gauss(0, 0.0022)
            void = abs(skew) > 0.0049 or number == 33
            runs.append(
                {
                    "run": number,
                    "attempt": 1,
                    "incline_deg": incline,
                    "impact_chain": "ABBA"[repeat % 4],
                    "separation_m": quantity(dz, 0.0011),
                    "separation_raw_m": quantity(dz - 4.9 * skew, 0.0009),
                    "speed_m_s": quantity(speed + rng.gauss(0, 0.05), 0.02),
                    "release_skew_s": quantity(skew, 0.0002),
                    "edges": {
                        "received": 226,
                        "matched": 225,
                        "missed": 1,
                        "spurious": 0,
                        "lost": 0,
                    },
                    "verdict": "void" if void else "accepted",
                    "reasons": ["release skew 5.3 ms is beyond 5 ms"] if void else [],
                }
            )
            if not void:
                values.append(dz)
        mean = sum(values) / len(values)
        sd = math.sqrt(sum((value - mean) ** 2 for value in values) / (len(values) - 1))
        summary.append(
            {
                "incline_deg": incline,
                "n": len(values),
                "separation_m": quantity(mean, sd / math.sqrt(len(values))),
                "separation_sd_m": sd,
                "speed_m_s": quantity(speed + rng.gauss(0, 0.03), 0.03),
                "predicted": {"separation_m": separation, "speed_m_s": speed},
                "normalized_error": rng.gauss(0, 0.5),
            }
        )
    summary.sort(key=lambda line: line["incline_deg"])
    runs[5]["budget"] = [
        {"name": "release skew", "quantity": "separation_m", "u": 0.00098},
        {"name": "beam heights", "quantity": "separation_m", "u": 0.0003},
        {"name": "clock", "quantity": "speed_m_s", "u": 0.0004},
    ]
    return {"runs": runs, "summary": summary}


def curves() -> dict[str, Any]:
    def alpha(theta: float) -> float:
        t = math.radians(theta)
        tilt = (1 - 0.2 / math.tan(t)) / (1 + 0.2 * math.tan(t))
        g = math.cos(t) ** 2 + math.sin(t) ** 2 * 4 / 3 * tilt
        return 0.25 * math.cos(t) ** 2 / g

    inclines = [0.0, 30.0, *map(float, range(30, 86))]
    segments = ["pile"] * 2 + ["surface"] * 56
    points = [(0.0801755, 6.2857635)] * 2
    points += [
        (0.73 * alpha(t) + 0.001, 5.1366 + 11.5 * alpha(t)) for t in map(float, range(30, 86))
    ]
    return {
        "incline_deg": inclines,
        "separation_m": [point[0] for point in points],
        "speed_m_s": [point[1] for point in points],
        "segments": segments,
        "separation_U95_m": [0.004] * len(points),
        "speed_U95_m_s": [0.08] * len(points),
        "free_fall_speed_m_s": 5.1366,
    }


def single_chain() -> dict[str, Any]:
    analysis = two_chains(repeats=4)
    for run in analysis["runs"]:
        del run["separation_raw_m"], run["release_skew_s"]
        run["impact_chain"] = "A"
    return analysis


def gravity(seed: int = 3) -> dict[str, Any]:
    rng = random.Random(seed)
    runs = [
        {
            "run": number,
            "attempt": 1,
            "incline_deg": 0.0,
            "impact_chain": None,
            "gravity_m_s2": quantity(9.8185 + rng.gauss(0, 0.004), 0.0035),
            "edges": {"received": 50, "matched": 50, "missed": 0, "spurious": 0, "lost": 0},
            "verdict": "accepted",
            "reasons": [],
        }
        for number in range(1, 11)
    ]
    return {
        "runs": runs,
        "summary": [
            {
                "incline_deg": 0.0,
                "n": 10,
                "gravity_m_s2": quantity(9.8188, 0.0014),
                "predicted": {"gravity_m_s2": 9.8201},
                "normalized_error": -0.42,
            }
        ],
    }
