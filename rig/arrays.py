"""Arrays of numbers, as types."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
"""Numbers of any shape."""
Flags: TypeAlias = NDArray[np.bool_]
"""Yes or no."""
Index: TypeAlias = NDArray[np.intp]
"""Places in other arrays."""
