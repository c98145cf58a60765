"""The runs of a protocol as a function, which the analysis still asks for."""

from rig.protocol.protocol import Protocol

runs = Protocol.runs
