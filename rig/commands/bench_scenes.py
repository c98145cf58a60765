"""``rig bench scenes``."""

from functools import partial

from rig.bench import scenes
from rig.commands.study import carry_out

main = partial(carry_out, "scenes", scenes.run)
