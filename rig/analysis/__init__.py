"""From raw edges to Δz, V and their uncertainties: pure functions, no I/O.

A drop goes through in one direction: `chain_records` (edges as times, gate by gate), `annealing`
(which edge is which rod), `identify` (which of several readings), `fit` (matched again in turn with
`adjust`: least squares for everything unknown), `edge_classes` (what became of every other edge)
and `verdict` (with `diagnoses` of gates and chains). A session then goes through `joint_fit` (all
good drops adjusted together), `budgets` (each drop's results in that light) and at last `summary`
over the runs of one incline.
"""
