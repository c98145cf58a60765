"""``rig gate``."""

from rig.commands.output import Arguments, say
from rig.model.photogate import design_photogate


def main(arguments: Arguments) -> None:
    """Print a photogate's resistors, and what follows from them."""
    how = arguments.distance, arguments.slit, arguments.led, arguments.detector
    for name, value in design_photogate(*how).items():
        print(f"{name:50}{float(f'{value:.4g}'):8g}")  # 18000, not 1.8e+04
    say("check the parts' values against their data sheets: firmware/README.md")
