"""From raw edges to Δz, V and their uncertainties: pure functions, no I/O.

A drop goes through in one direction: `trains` (edges as times, gate by gate), `pattern` (a first
guess of the fall), `align` (which edge is which rod), `adjust` (least squares for everything
unknown), `verdict`, and at last `summary` over the runs of one incline.
"""
