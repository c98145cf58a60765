"""Least squares on reference data of NIST (Statistical Reference Datasets), to certified values.

Data and certified values as published at https://www.itl.nist.gov/div898/strd (public domain).
"""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from rig.analysis.adjust import least_squares
from tests.analysis.least_squares import plain_equations

DIGITS = 1e-4
VAGUE = 1e10  # times a starting value: a prior that pulls by less than a digit
STEPS = 5000  # from the farther start some lead through long valleys
FOLDER = Path(__file__).parent / "nist"


def decay(b, x):
    return sum(b[n] * np.exp(-b[n + 1] * x) for n in range(0, 6, 2))


def peaks(b, x):
    return b[0] * np.exp(-b[1] * x) + sum(
        b[n] * np.exp(-(((x - b[n + 1]) / b[n + 2]) ** 2)) for n in (2, 5)
    )


def cubics(b, x):
    top, bottom = (b[0], b[1], b[2], b[3]), (1, b[4], b[5], b[6])
    above, below = (sum(c * x**n for n, c in enumerate(part)) for part in (top, bottom))
    return above / below


def seasons(b, x):
    found = b[0]
    for period, one, two in ((12, b[1], b[2]), (b[3], b[4], b[5]), (b[6], b[7], b[8])):
        turn = 2 * PI * x / period
        found = found + one * np.cos(turn) + two * np.sin(turn)
    return found


PI = np.longdouble("3.141592653589793238462643383279")
MODELS = {
    "Bennett5": lambda b, x: b[0] * (b[1] + x) ** (-1 / b[2]),
    "BoxBOD": lambda b, x: b[0] * (1 - np.exp(-b[1] * x)),
    "Chwirut1": lambda b, x: np.exp(-b[0] * x) / (b[1] + b[2] * x),
    "DanWood": lambda b, x: b[0] * x ** b[1],
    "ENSO": seasons,
    "Eckerle4": lambda b, x: b[0] / b[1] * np.exp(-(((x - b[2]) / b[1]) ** 2) / 2),
    "Gauss1": peaks,
    "Hahn1": cubics,
    "Kirby2": lambda b, x: (b[0] + b[1] * x + b[2] * x**2) / (1 + b[3] * x + b[4] * x**2),
    "Lanczos1": decay,
    "MGH09": lambda b, x: b[0] * (x**2 + x * b[1]) / (x**2 + x * b[2] + b[3]),
    "MGH10": lambda b, x: b[0] * np.exp(b[1] / (x + b[2])),
    "MGH17": lambda b, x: b[0] + b[1] * np.exp(-x * b[3]) + b[2] * np.exp(-x * b[4]),
    "Misra1b": lambda b, x: b[0] * (1 - (1 + b[1] * x / 2) ** -2),
    "Misra1c": lambda b, x: b[0] * (1 - (1 + 2 * b[1] * x) ** -0.5),
    "Misra1d": lambda b, x: b[0] * b[1] * x / (1 + b[1] * x),
    "Nelson": lambda b, x, hot: b[0] - b[1] * x * np.exp(-b[2] * hot),
    "Rat42": lambda b, x: b[0] / (1 + np.exp(b[1] - b[2] * x)),
    "Rat43": lambda b, x: b[0] / (1 + np.exp(b[1] - b[2] * x)) ** (1 / b[3]),
    "Roszman1": lambda b, x: b[0] - b[1] * x - np.arctan(b[2] / (x - b[3])) / PI,
}
ALIKE = {
    "Chwirut2": "Chwirut1", "Gauss2": "Gauss1", "Gauss3": "Gauss1", "Lanczos2": "Lanczos1",
    "Lanczos3": "Lanczos1", "Misra1a": "BoxBOD", "Thurber": "Hahn1",
}  # fmt: skip
POWERS = {"Norris": 1, "Pontius": 2, "Filip": 10} | {f"Wampler{n}": 5 for n in range(1, 6)}


def read(name):
    """Lines of labelled numbers, then the data: y and what it depends on."""
    lines = (FOLDER / f"{name}.txt").read_text().split("\n")
    lines = [line for line in lines if line and not line.startswith("#")]
    begin = lines.index("data")
    labelled = {
        label: np.array(numbers, dtype=float)
        for label, *numbers in (line.split() for line in lines[:begin])
    }
    return labelled, np.array([line.split() for line in lines[begin + 1 :]], dtype=np.longdouble)


def fit(model, begin, sd, y, x, done):
    """Estimates and standard deviations, and whether the fit converged.

    Residuals are made in extended precision, for Lanczos1's are as small as a double's rounding,
    and slopes by a complex step, which rounds nothing away.
    """
    sigma = 1e-16 * float(np.abs(y).max())

    def equations(at, inflation):
        b = at.astype(np.longdouble)
        left = (model(b, *x) - y).astype(float)
        aside = 1e-30 * np.eye(b.size) * np.maximum(np.abs(b), 1e-30)
        slopes = [model(b + 1j * row, *x).imag / row.sum() for row in aside]
        slopes = [np.broadcast_to(one, y.shape) for one in slopes]
        return plain_equations(
            left / (sigma * inflation), np.stack(slopes, axis=1).astype(float) / (sigma * inflation)
        )

    found = least_squares(equations, sd, begin, begin, done=done, steps=STEPS)
    scatter = math.sqrt(found.chi2 / (y.size - sd.size))
    return found.x, scatter * np.linalg.norm(found.inverse, axis=1) * sd, found.settled


NAMES = sorted(one.stem for one in FOLDER.glob("*.txt"))
NONLINEAR = sorted([*MODELS, *ALIKE])
LINEAR = [name for name in NAMES if name not in NONLINEAR]
TOO_FAR = {("MGH10", "start1")}  # the valley bends so much that damped steps end in it
STARTS = sorted({*itertools.product(NONLINEAR, ["start1", "start2"])} - TOO_FAR)


@pytest.mark.parametrize(("name", "start"), STARTS)
def test_certified_values_are_met(name, start):
    """Four digits and more of values and standard deviations, from both published starts."""
    labelled, data = read(name)
    y = np.log(data[:, 0]) if name == "Nelson" else data[:, 0]
    begin = labelled[start]
    model = MODELS[ALIKE.get(name, name)]
    scatter = math.sqrt(labelled["squares"][0] / (y.size - begin.size))
    done = max(1e-6, 2 * np.finfo(float).eps * float(np.abs(y).max()) / scatter)  # what is rounded
    values, deviations, settled = fit(model, begin, VAGUE * np.abs(begin), y, data[:, 1:].T, done)
    assert settled
    np.testing.assert_allclose(values, labelled["certified"], rtol=DIGITS)
    np.testing.assert_allclose(deviations, labelled["deviation"], rtol=DIGITS)


@pytest.mark.parametrize("name", LINEAR)
def test_certified_values_of_linear_models_are_met(name):
    """Where nothing is left over, the certified standard deviations are zero."""
    labelled, data = read(name)
    y, x = data[:, 0], data[:, 1:].T
    if name in POWERS:
        x = np.stack([x[0] ** n for n in range(POWERS[name] + 1)])
    elif name == "Longley":
        x = np.stack([np.ones_like(y), *x])
    sd = VAGUE * np.abs(y).max() / np.abs(x).max(axis=1)
    begin = np.zeros(sd.size)
    values, deviations, settled = fit(
        lambda b, *x: b @ np.stack(x), begin, sd.astype(float), y, x, 1e-6
    )
    assert settled
    np.testing.assert_allclose(values, labelled["certified"], rtol=DIGITS)
    told = labelled["deviation"] > 0.0
    np.testing.assert_allclose(deviations[told], labelled["deviation"][told], rtol=DIGITS)
