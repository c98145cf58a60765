"""Lab-rig controller for falling-chain and photogate experiments."""

__version__ = "0.1.0"
