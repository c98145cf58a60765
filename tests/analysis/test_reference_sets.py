"""Least squares on reference data of NIST (Statistical Reference Datasets), to certified values.

Data and certified values as published at https://www.itl.nist.gov/div898/strd (public domain).
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from rig.analysis.adjust import least_squares
from rig.analysis.equations import plain_equations

VAGUE = 1e4  # certified standard deviations: a prior that pulls by 1e-8 of one

# Longley (higher difficulty): y, x1 … x6.
LONGLEY = """
60323 83.0 234289 2356 1590 107608 1947
61122 88.5 259426 2325 1456 108632 1948
60171 88.2 258054 3682 1616 109773 1949
61187 89.5 284599 3351 1650 110929 1950
63221 96.2 328975 2099 3099 112075 1951
63639 98.1 346999 1932 3594 113270 1952
64989 99.0 365385 1870 3547 115094 1953
63761 100.0 363112 3578 3350 116219 1954
66019 101.2 397469 2904 3048 117388 1955
67857 104.6 419180 2822 2857 118734 1956
68169 108.4 442769 2936 2798 120445 1957
66513 110.8 444546 4681 2637 121950 1958
68655 112.6 482704 3813 2552 123366 1959
69564 114.2 502601 3931 2514 125368 1960
69331 115.7 518173 4806 2572 127852 1961
70551 116.9 554894 4007 2827 130081 1962
"""
MISRA1A = """
10.07 77.6
14.73 114.9
17.94 141.1
23.93 190.8
29.61 239.9
35.18 289.0
40.02 332.8
44.82 378.4
50.76 434.8
55.05 477.3
61.01 536.8
66.40 593.1
75.47 689.1
81.78 760.0
"""
ROSZMAN1 = """
0.252429 -4868.68
0.252141 -4868.09
0.251809 -4867.41
0.297989 -3375.19
0.296257 -3373.14
0.295319 -3372.03
0.339603 -2473.74
0.337731 -2472.35
0.333820 -2469.45
0.389510 -1894.65
0.386998 -1893.40
0.438864 -1497.24
0.434887 -1495.85
0.427893 -1493.41
0.471568 -1208.68
0.461699 -1206.18
0.461144 -1206.04
0.513532 -997.92
0.506641 -996.61
0.505062 -996.31
0.535648 -834.94
0.533726 -834.66
0.568064 -710.03
0.612886 -530.16
0.624169 -464.17
"""


def linear(b, x):
    slopes = np.column_stack([np.ones(len(x)), x])
    return slopes @ b, slopes


def misra1a(b, x):
    left = np.exp(-b[1] * x[:, 0])
    return b[0] * (1 - left), np.stack([1 - left, b[0] * x[:, 0] * left], axis=1)


def roszman1(b, x):
    off = x[:, 0] - b[3]
    bend = 1 / (math.pi * (off**2 + b[2] ** 2))
    slopes = [np.ones_like(off), -x[:, 0], -off * bend, -b[2] * bend]
    return b[0] - b[1] * x[:, 0] - np.arctan(b[2] / off) / math.pi, np.stack(slopes, axis=1)


SETS = {
    "Longley": (
        LONGLEY, linear, (0.0,) * 7, 304.854073561965,
        (-3482258.63459582, 15.0618722713733, -0.0358191792925910, -2.02022980381683,
         -1.03322686717359, -0.0511041056535807, 1829.15146461355),
        (890420.383607373, 84.9149257747669, 0.0334910077722432, 0.488399681651699,
         0.214274163161675, 0.226073200069370, 455.478499142212),
    ),
    "Misra1a": (
        MISRA1A, misra1a, (250.0, 5e-4), 0.10187876330,
        (2.3894212918e02, 5.5015643181e-04), (2.7070075241, 7.2668688436e-06),
    ),
    "Roszman1": (
        ROSZMAN1, roszman1, (0.2, -5e-6, 1200.0, -150.0), 4.8542984060e-03,
        (2.0196866396e-01, -6.1953516256e-06, 1.2044556708e03, -1.8134269537e02),
        (1.9172666023e-02, 3.2058931691e-06, 7.4050983057e01, 4.9573513849e01),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SETS)
def test_certified_values_are_met(name):
    """Values and standard deviations to six digits; normal equations halve those of a QR."""
    text, function, start, scatter, certified, deviations = SETS[name]
    data = np.array([line.split() for line in text.split("\n") if line], dtype=float)
    y, x = data[:, 0], data[:, 1:]
    begin, sd = np.array(start), VAGUE * np.array(deviations)

    def equations(off, inflation):
        values, slopes = function(begin + off, x)
        weight = 1 / (scatter * inflation)
        return plain_equations((values - y) * weight, slopes * weight, sd)

    found = least_squares(equations, sd, np.zeros(sd.size), done=1e-9)
    assert found.settled
    off = (begin + found.x - certified) / np.array(deviations)
    assert np.abs(off).max() < 1e-5
    u = np.sqrt(np.diag(found.covariance)) * sd
    np.testing.assert_allclose(u, deviations, rtol=1e-6)
    assert found.chi2 == pytest.approx(y.size - begin.size, rel=1e-6)
    assert found.scatter == 1.0
