from rig.door import open as open  # noqa: A004
from rig.door import predict as predict
from rig.door import read_protocol as read_protocol

__version__: str
