"""Rods, strings and a board, resolved in time: falls that know nothing of Eqs. 8 to 13.

Rods are rigid cylinders in three dimensions, strings between their ends only pull, and every
contact lasts its 0.1 to 0.3 ms. `fall` lets a chain fall. Nothing here imports the rig's model, nor
anything else of it: see the contract in pyproject.toml.
"""
