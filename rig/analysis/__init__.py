"""From raw edges to Δz, V and their uncertainties: pure functions, no I/O.

A drop passes these modules in order: `chain_records` (edges as times, gate by gate), `annealing`
(assignment of edges to rods), `identify` (best of several readings), `fit` (matching in turn with
`adjust`, least squares for all unknowns), `edge_classes` (classes of unmatched edges) and `verdict`
(with `diagnoses` of gates and chains). A session then passes `joint_fit` (all good drops fitted
together), `budgets` (each drop's results from the joint fit) and `summary` (means for each
incline).
"""
