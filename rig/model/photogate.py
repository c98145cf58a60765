"""Design of a photogate from parts: load and LED resistors, and the margins for the worst parts.

The phototransistor feeds a load to ground, and the LED's current is trimmed until the lit beam
gives twice the comparator's threshold. So the threshold is at half light, and equal loads give
equal delays for all parts. firmware/README.md has the formulas and their sources.
"""

import math

from rig.errors import InputError
from rig.text_rows import read_rows

PARTS = {part: [*map(float, values)] for part, *values in read_rows(__file__)}
"""Values of LEDs and phototransistors by their names, as ``photogate.txt`` explains them."""
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
    least, most, angle, daylight, time_s, at_ohm = PARTS[detector]
    dimmest, brightest = PARTS[led]
    share = min(1.0, 4 * slit_m / (math.pi * APERTURE_M))
    gain = 1e-2 * share / (100 * distance_m) ** 2  # A of light per A of the LED's: E = I/d²
    weak, strong = gain * ALIGNMENT * dimmest * least, gain * brightest * most
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
