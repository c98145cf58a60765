"""Maps of the model's predictions over a grid of parameters."""
