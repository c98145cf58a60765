"""Local gravity from latitude and height."""

import math

from rig.units import Quantity

# WGS 84 defining and derived constants, NGA.STND.0036_1.0.0_WGS84 (2014), section 4.2 and table 3.5
_EQUATOR = 9.7803253359  # normal gravity at the equator, m/s²
_SOMIGLIANA = 0.001931852652458  # k of Somigliana's formula
_ECCENTRICITY_SQUARED = 0.00669437999014
_FREE_AIR = 3.086e-6  # fall of gravity per metre of height, 1/s²

ANOMALY_U = 5e-4
"""Standard uncertainty of the result, m/s²: the ground differs from the formula by tens of mGal
(1 mGal = 1e-5 m/s²), 50 mGal being usual in hills and mountains."""


def gravity_at(latitude_deg: float, height_m: float) -> Quantity:
    """Return the local acceleration of free fall.

    Somigliana's closed formula on the WGS 84 ellipsoid with the free-air correction.

    Parameters
    ----------
    latitude_deg
        Geodetic latitude, degrees.
    height_m
        Height above sea level, m.

    Returns
    -------
    Quantity
        m/s², with the spread of local anomalies as its standard uncertainty.
    """
    square = math.sin(math.radians(latitude_deg)) ** 2
    normal = _EQUATOR * (1 + _SOMIGLIANA * square) / math.sqrt(1 - _ECCENTRICITY_SQUARED * square)
    return Quantity(normal - _FREE_AIR * height_m, ANOMALY_U)
