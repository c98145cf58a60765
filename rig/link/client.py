"""The host's side of the conversation: requests, repeats, and the reading of a drop."""

from contextlib import suppress
from functools import partial

from rig.boards import LONGEST_RECORD_MS
from rig.errors import DeviceTimeoutError
from rig.link import messages as wire
from rig.link.assembly import Assembly
from rig.link.exchange import Exchange, Halted
from rig.link.frames import DELIMITER
from rig.link.port import BAUDRATE
from rig.link.refusals import DeviceRefusedError
from rig.link.transcript import Incoming
from rig.reasons import rig_error
from rig.records import ClockSample, Drop

BOOT_WAIT_S = 2.0
"""In which every boot loader starts the firmware, if it hears nothing: the Mega's after 0.83 s."""
LOADER_WAIT_S = 6.0
"""The Mega's boot loader, once it has heard anything, goes on 5 s after the last byte."""
_IDENTIFY_TRIES = 4
_LOADER_BAUDRATE = 115_200
_LEAVE = bytes.fromhex("1b 01 00 01 0e 11 04")
"""CMD_LEAVE_PROGMODE_ISP of STK500 version 2 (Atmel AVR068), as the Mega's boot loader has it."""
_LEAVE_S = 0.1
_LATE_S = 0.25  # how much later than announced a certificate may come before the host asks
_SMALLEST_READ = 4
_FIRE_WAIT_S = 0.05
"""Two FIREs may be lost before an armed device takes the host for gone."""
_ABORT_WAIT_S = 0.03
"""Five ABORTs leave within the 250 ms after which everything shall be off."""


def _is_boot(got: Incoming) -> bool:
    return isinstance(got.message, wire.Boot)


class Device(Exchange):
    """A device on an open port. Not for use from several threads at once.

    A tap is called with every byte before anything else is done with it, so that what was recorded
    is never behind what was acted upon; for the parameters see `rig.link.exchange.Exchange`.
    """

    def connect(self, boot_wait_s: float = BOOT_WAIT_S) -> wire.Identity:
        """Find out who is there.

        Parameters
        ----------
        boot_wait_s
            How long to wait for a board that restarts because its port was opened; 0 when it is
            known to be running.

        Returns
        -------
        Identity
            The device's account of itself.

        Raises
        ------
        DeviceError
            Protocol versions differ, or nobody answers.
        """
        self.expect_boot = True
        try:
            self.write(DELIMITER)  # ends whatever junk the line has seen so far
            self.wait_for(boot_wait_s, _is_boot)
            for wake in (self._leave_loader, partial(self.wait_for, LOADER_WAIT_S, _is_boot)):
                with suppress(DeviceTimeoutError):
                    return self._identify()
                wake()
            return self._identify()
        finally:
            self.expect_boot = False

    def _identify(self) -> wire.Identity:
        identity = self.request(wire.Identify(), wire.Identity, min(self.tries, _IDENTIFY_TRIES))
        if identity.protocol_version != wire.PROTOCOL_VERSION:
            raise DeviceRefusedError(wire.RefusalReason.VERSION, identity.protocol_version)
        return identity

    def _leave_loader(self) -> None:
        """Tell a boot loader, which any byte before has held, to start the firmware."""
        self.set_rate(_LOADER_BAUDRATE)
        self.write(_LEAVE)
        self.wait_for(_LEAVE_S, _is_boot)
        self.set_rate(BAUDRATE)

    def statistics(self) -> dict[str, int]:
        """Count frames, faults and bytes since the connection began.

        Returns
        -------
        dict
            By the names of the daemon's interface (rig/daemon/API.md).
        """
        counts = ("requests", "repeats", "rx_bytes", "tx_bytes")
        return {
            "rx_frames": self.transcript.rx.good,
            "rx_bad": self.transcript.rx.bad,
            "rx_unreadable": self.transcript.unreadable,
            "port_waiting": self.waiting(),
        } | {name: getattr(self, name) for name in counts}

    def ping(self) -> ClockSample | None:
        """Take a clock sample.

        Returns
        -------
        ClockSample or None
            `None` when the request had to be repeated: such a sample would be ambiguous.
        """
        self.transcript.sample = None
        self.request(wire.Ping(), wire.Pong)
        return self.transcript.sample

    def status(self) -> wire.State:
        """Ask what the device is doing."""
        return self.request(wire.Status(), wire.State)

    def reference(self) -> wire.ReferencePulse:
        """Ask for the latest pulse of the 1 Hz reference; its count is 0 when none is wired."""
        return self.request(wire.Reference(), wire.ReferencePulse)

    def arm(self, order: wire.Arm) -> int:
        """Prepare a drop.

        From now until `fire` the device wants to hear a request, any request, every
        `HOST_SILENCE_MS`: else it disarms itself.

        Returns
        -------
        int
            The token that fires.

        Raises
        ------
        DeviceRefusedError
            A gate is blocked, the release is too warm, another drop is held, a parameter is out
            of range, the emergency stop is open.
        """
        return self.request(order, wire.Armed).token

    def fire(self, token: int) -> int:
        """Let go; from now until `collect` returns the host stays silent.

        Parameters
        ----------
        token
            From `arm`.

        Returns
        -------
        int
            The tick (u32) of the release.

        Raises
        ------
        DeviceRefusedError
            A gate is blocked or was since arming, or the device is not armed any more; nothing
            was released.
        """
        return self.request(wire.Fire(token), wire.Fired, wait=_FIRE_WAIT_S).tick

    def abort(self) -> None:
        """Switch the release off, disarm, end a recording."""
        self.request(wire.Abort(), wire.Done, wait=_ABORT_WAIT_S)

    def acknowledge(self, label: int, crc32: int) -> None:
        """Let the device forget a drop: call it when the drop is safe on disk, not before.

        Parameters
        ----------
        label, crc32
            As the drop's certificate has them.

        Raises
        ------
        DeviceRefusedError
            The device holds no such drop, or holds other data.
        """
        self.request(wire.Acknowledge(label, crc32), wire.Done)

    def collect(self, label: int, timeout: float | None = None, stop: Halted | None = None) -> Drop:
        """Wait for a fired drop and read it whole.

        Parameters
        ----------
        label
            The drop's label.
        timeout
            Seconds without a certificate after which the host asks; by default the recording
            time and a margin.
        stop
            Asked every few milliseconds; when true, the recording is aborted and what there is
            is collected.

        Returns
        -------
        Drop
            As `Transcript.pending` has it; see its faults.

        Raises
        ------
        DeviceError
            The board restarted, lost the drop, or fell silent.
        """
        drop = self.transcript.assembly(label)
        if timeout is None:
            timeout = drop.record_ms / 1000 + _LATE_S
        now_ns = self.clock.now_ns
        hopeless = now_ns() + round((LONGEST_RECORD_MS / 1e3 + timeout) * 1e9)
        ask = now_ns() + round(timeout * 1e9)
        while drop.certificate is None:
            self.receive()
            if stop is not None and stop():
                stop = None
                self.abort()
                ask = now_ns() + round(_LATE_S * 1e9)
            elif now_ns() >= ask and drop.certificate is None:
                state = self.status()
                if (state.phase, state.label) != (wire.Phase.RECORDING, label):
                    break  # the certificate was lost on the way, or the drop is gone
                if now_ns() >= hopeless:
                    raise rig_error("device_endless")
                ask = now_ns() + round(_LATE_S * 1e9)
        return self.fetch(label)

    def fetch(self, label: int) -> Drop:
        """Read a drop the device holds, as far as it is not known already.

        Parameters
        ----------
        label
            The drop's label.

        Returns
        -------
        Drop
            As `Transcript.pending` has it; see its faults.

        Raises
        ------
        DeviceError
            The device does not hold it, or fell silent.
        """
        drop = self.transcript.assembly(label)
        if drop.certificate is None:
            self.request(wire.Read(label, 0, 0), wire.DropCertificate)
        self._read_missing(drop)
        certificate, identity = drop.certificate, self.transcript.identity
        if certificate and not drop.missing() and not drop.sound():
            # Two CRC-16 collisions in one drop are all but impossible: once more is enough.
            drop.forget_events(identity.capacity if identity else certificate.events)
            self._read_missing(drop)
        return self.transcript.pending(label)

    def _read_missing(self, drop: Assembly) -> None:
        """Ask for missing events in ever smaller pieces: on a bad line short frames get through."""
        size = wire.EVENTS_PER_FRAME
        failures = 0
        while missing := drop.missing(drop.first_kept):
            first = missing[0]
            count = sum(number == first + n for n, number in enumerate(missing[:size]))
            try:
                self.request(wire.Read(drop.label, first, count), wire.EventsFrame, tries=2)
            except DeviceRefusedError as refused:
                # What it does not keep any more stays missing, and makes the drop faulty.
                if refused.reason is not wire.RefusalReason.NOT_KEPT or refused.detail <= first:
                    raise
            except DeviceTimeoutError:
                failures += 1
                if failures > self.tries:
                    raise
                size = max(_SMALLEST_READ, size // 2)
            else:
                if first in drop.missing():
                    raise rig_error("events_not_sent")
                failures = 0
