"""Design of a photogate from parts: load and LED resistors, and the margins for the worst parts.

The phototransistor feeds a load to ground, and the LED's current is trimmed until the lit beam
gives twice the comparator's threshold. So the threshold is at half light, and equal loads give
equal delays for all parts. firmware/README.md has the formulas and their sources.
"""

from __future__ import annotations

import math

from rig.errors import InputError

LEDS = {"TSAL6100": (80.0, 400.0), "TSAL6200": (40.0, 200.0), "TSAL6400": (25.0, 125.0)}
"""Radiant intensity at 0.1 A, least and greatest, mW/sr. From memory of Vishay 81009, 81010 and
81011: compare with *Basic Characteristics* there."""
DETECTORS = {
    "BPW85": (0.8, 8.0, 25.0, 0.7, 2e-6, 100.0),
    "BPW85C": (3.0, 8.0, 25.0, 0.7, 2e-6, 100.0),
    "SFH309FA": (0.8, 4.0, 12.0, 0.35, 9e-6, 1000.0),
}
"""Photocurrent at 1 mW/cm², least and greatest, mA; half angle, degrees; share of daylight that it
sees; switching time, s, at a load, Ω. Current and angle of the BPW85 are those of Vishay 81531
(revision 2.1, *Product Summary*); all else is from memory of it and of Osram's SFH 309 FA."""
THRESHOLD_V, HYSTERESIS_V = 1.22, 0.15  # 33 kΩ over 10 kΩ at 5 V; 220 kΩ from the output
LED_OHM, LED_V, LED_A, ALIGNMENT = 68.0, 1.35, 0.05, 0.8
APERTURE_M, LM_PER_MW_CM2 = 3e-3, 1100.0
E12 = (10, 12, 15, 18, 22, 27, 33, 39, 47, 56, 68, 82)


def design_photogate(distance_m: float, slit_m: float, led: str, detector: str) -> dict[str, float]:
    """Return resistors of a gate that suit all specimens of these parts, and derived values.

    Raises
    ------
    InputError
        The weakest pair receives too little light.
    """
    least, most, angle, daylight, time_s, at_ohm = DETECTORS[detector]
    share = min(1.0, 4 * slit_m / (math.pi * APERTURE_M))
    gain = 1e-2 * share / (100 * distance_m) ** 2  # A of light per A of the LED's: E = I/d²
    weak, strong = gain * ALIGNMENT * LEDS[led][0] * least, gain * LEDS[led][1] * most
    load = next_standard(2 * THRESHOLD_V / (weak * LED_A))
    if load > 2e4:
        raise InputError("too little light", "move closer, or choose other parts or a wider slit")
    lit_ma, dark_ma = 2e3 * THRESHOLD_V / load, 1e3 * (THRESHOLD_V - HYSTERESIS_V / 2) / load
    sees = share * most * daylight * math.sin(math.radians(angle)) ** 2
    edge_s = time_s * max(1.0, load / at_ohm)
    return {
        "load resistor, Ω": load,
        "LED resistor, Ω": LED_OHM,
        "LED trimmer, Ω, at least": next_standard(1e3 * strong * (5 - LED_V) / lit_ma - LED_OHM),
        "LED current, weakest parts, mA": lit_ma / weak,
        "LED current, strongest parts, mA": lit_ma / strong,
        "lit, V (twice the threshold)": 2 * THRESHOLD_V,
        "hysteresis, % of the light": 50 * HYSTERESIS_V / THRESHOLD_V,
        "edge, µs": 1e6 * edge_s,
        "edge at 6 m/s, mm": 6e3 * edge_s,
        "daylight at which a blocked beam seems clear, lx": dark_ma / sees * LM_PER_MW_CM2,
    }


def next_standard(ohm: float) -> float:
    """Return a resistance rounded up to the E12 series, Ω."""
    decade = 10.0 ** (math.floor(math.log10(ohm)) - 1)
    return next((n * decade for n in E12 if n * decade > 0.999 * ohm), 100 * decade)
