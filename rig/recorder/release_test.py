"""The release driven once with nothing hung from it: a drop of no run, of which only bytes stay."""

from contextlib import suppress
from typing import Any

from rig.errors import DeviceError
from rig.link.exchange import Halted
from rig.link.messages import TEST_RUN, Phase, pack_label
from rig.protocol.protocol import Protocol
from rig.recorder.recorder import Recorder, arm_order

_LABEL = pack_label(TEST_RUN, 1)
_TIMEOUT_MS = 1000  # it is fired at once, or never
_AFTER_MS = 500  # what falls or trembles because of the pulse has been seen by then


def drive(recorder: Recorder, protocol: Protocol, halted: Halted) -> dict[str, Any]:
    """Arm and fire with the protocol's pulse, and look what the gates see of it.

    Parameters
    ----------
    recorder
        Connected, with nothing armed.
    protocol
        Its gates and its release.
    halted
        Asked all the time whether everything shall be off.

    Returns
    -------
    dict
        The section `release_test` of the daemon's state, see rig/daemon/API.md.

    Raises
    ------
    DeviceRefusedError
        A gate is blocked, the release is too warm, the emergency stop is open, a drop is held.
    StoppedError
        It was stopped; the release is off.
    """
    device, pulse_s = recorder.device, protocol.release.pulse
    record_ms = round(pulse_s * 1e3) + _AFTER_MS
    token = device.arm(arm_order(protocol, _LABEL, _TIMEOUT_MS, record_ms))
    try:
        recorder.go_on()
        device.fire(token)
        drop = device.collect(_LABEL, stop=halted)
    except BaseException:
        with suppress(DeviceError):
            device.abort()
            forget(recorder)
        raise
    forget(recorder)
    recorder.go_on()
    sensed = drop.certificate.release_sense if drop.certificate else None
    return {
        "pulse_s": pulse_s,
        "release_sense_s": None if sensed is None else sensed / drop.tick_hz,
        "edges": len(drop.edges),
        "gates": sorted({edge.channel for edge in drop.edges}),
        "faults": [fault.text for fault in drop.faults],
    }


def forget(recorder: Recorder) -> None:
    """Let the device forget a test's drop, when it holds one: it would forbid the next."""
    device = recorder.device
    state = device.status()
    if state.drop is None or state.label != _LABEL:
        return
    if state.phase is Phase.RECORDING:
        device.abort()
    certificate = device.collect(_LABEL, timeout=0.0).certificate
    if certificate is not None:
        device.acknowledge(_LABEL, certificate.crc32)
    device.status()  # whoever watches sees that it is at rest again
