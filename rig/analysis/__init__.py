"""From edges to Δz, V and their uncertainties."""
