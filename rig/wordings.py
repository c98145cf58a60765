"""The one table of what the program says of each code: how bad it is, its label, sentence, remedy.

`rig.reasons` fills in values and the words of a scene; sentences are written here, never read back.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

OPERATOR, NOTE, SENTENCE = "operator", "note", "sentence"
"""Codes of what is only text: a cause to reject a drop, a note to it, a sentence of an old file."""


class Severity(IntEnum):
    """What a reason does to a verdict."""

    REMARK = 0
    DOUBT = 1
    VOID = 2


@dataclass(frozen=True, slots=True)
class Wording:
    """What the program says of one code.

    Attributes
    ----------
    severity
        What it does to a verdict.
    label
        In a few words, where several drops have it; empty where no drop does.
    sentence
        With places for values, see `_Phrases`.
    remedy
        What to do about it; empty where nothing is to be done.
    """

    severity: Severity
    label: str
    sentence: str
    remedy: str = ""


def _finding(sentence: str, remedy: str = "") -> Wording:
    return Wording(Severity.DOUBT, "", sentence, remedy)


def _remark(sentence: str) -> Wording:
    return Wording(Severity.REMARK, "", sentence)


_VOID, _DOUBT, _REMARK = Severity.VOID, Severity.DOUBT, Severity.REMARK
_COMPARE = "compare {setup} with rig check PROTOCOL"
LOOK = "look at the drop's edges: rig report SESSION draws them beside the expected fall"
_BEAM = "clear and align the gate's beam, or measure its height again"
_HEIGHT = "measure the gate's height again and correct the protocol"
_BOARD = "check cable and supply of the board, then drop again; rig selftest tests them"
_MISSED = (
    "align the gates' beams with {body}; rig report SESSION shows which gate misses most edges"
)
_STRAY = (
    "keep everything else out of the beams and give each gate its own channel; "
    "rig report SESSION draws every edge"
)
_SKEW = "adjust the releases until both chains leave together, or raise accept.release_skew"
_AGAIN = "drop again"
_RESUME = "arm again when all is well; a rig run goes on by the same command"
_STOP = "see that nobody is in danger and close it, then arm again"

WIRING = "the release's wiring (a coil without a diode resets boards)"
SUPPLY = "is its supply shared with the magnets?"
_CLEAR = "clear the beam, and see that its emitter has power and its plugs sit"
_STILL = f"{_CLEAR}; let everything come to rest"
_CABLE = "take another cable or USB port"
_FLASH = "write the firmware for this very board: rig flash"
_LOOPBACK = "check the wire from the sync output to this gate"
_RULE = (
    "python -m rig.usb.udev | sudo tee /etc/udev/rules.d/60-chainrig.rules, then "
    "sudo udevadm control --reload and sudo udevadm trigger"
)

WORDINGS: dict[str, Wording] = {
    # The record.
    "edges_lost": Wording(
        _VOID, "edges lost", "the board lost {lost} edges because its memory was full",
        "find the gate that flickers, then shield or unplug it"),
    "no_identity": Wording(
        _VOID, "board unknown", "the board never identified itself, so its tick rate is unknown",
        _BOARD),
    "restarted": Wording(
        _VOID, "board restarted", "the board restarted before the drop was read", _BOARD),
    "no_certificate": Wording(
        _VOID, "record not closed", "no certificate: the board did not close the record", _BOARD),
    "events_missing": Wording(
        _VOID, "events missing", "{missing} of {events} events missing, from number {first}", _BOARD
    ),
    "events_overwritten": Wording(
        _VOID, "events overwritten",
        "{missing} of {events} events no longer kept by the board, from number {first}", _BOARD),
    "crc_mismatch": Wording(
        _VOID, "checksum wrong", "the events do not match the certificate's CRC-32", _BOARD),
    "record_damaged": Wording(
        _VOID, "record damaged", "damaged: {text}; see rig recover SESSION",
        "rig recover SESSION says what is whole, and with -o NEW saves it"),
    "record_torn": Wording(
        _VOID, "record torn", "a part of the record was lost with its file",
        "measure this run again"),
    "pulse_cut": Wording(
        _VOID, "release cut short",
        "the release pulse ended after {lasting_s:.3g ms}: the board found it out of order",
        "look for a short circuit at the release's output; rig selftest tests it"),
    "pulse_stopped": Wording(
        _VOID, "release cut short",
        "the release pulse ended after {lasting_s:.3g ms}: the emergency stop opened",
        "drop again; if nobody opened the stop, shield its cable and put 47 nF across it at the "
        "board"),
    "pulse_aborted": Wording(
        _VOID, "release cut short",
        "the release pulse ended after {lasting_s:.3g ms}: the drop was aborted", _AGAIN),
    "connection_ended": Wording(
        _VOID, "connection ended", "the connection ended before the drop was recorded", _AGAIN),
    # Which edge is what.
    "few_edges_fit": Wording(
        _VOID, "no such fall",
        "only {share:.0%} of the expected edges{on_side} fit a fall of {body}", _COMPARE),
    "no_fall": Wording(
        _VOID, "no such fall", "no fall of {body} fits enough of the edges", _COMPARE),
    "two_falls": Wording(
        _VOID, "two falls fit",
        "two falls fit these edges: the likelier has odds of {odds:.3g} to 1",
        "add or move a gate; rig check PROTOCOL says how many simulated drops are identified then"),
    "two_falls_gate": Wording(
        _VOID, "two falls fit",
        "two falls fit these edges: the likelier has odds of {odds:.3g} to 1; one more gate at "
        "{height_m:.0f mm}{on_side} would decide",
        "put a gate there, or move one; rig check PROTOCOL says how many simulated drops are "
        "identified then"),
    "edges_missed": Wording(
        _VOID, "edges missed",
        "{missed} of {expected} edges missed ({share_of_edges}), limit {limit:.1%}", _MISSED),
    "edges_missed_few": Wording(
        _DOUBT, "edges missed",
        "{missed} of {expected} edges missed ({share_of_edges}), limit {limit:.1%}; of so few "
        "edges this may be chance", _MISSED),
    "edges_unexplained": Wording(
        _VOID, "edges unexplained",
        "{unexplained} of {received} edges unexplained ({share_of_edges}), limit {limit:.1%}",
        _STRAY),
    "edges_unexplained_few": Wording(
        _DOUBT, "edges unexplained",
        "{unexplained} of {received} edges unexplained ({share_of_edges}), limit {limit:.1%}; this "
        "may be one stray pulse", _STRAY),
    "later_passages": Wording(
        _REMARK, "later passages",
        "{edges} edges after the passage were left out: {body} came back"),
    # Gates.
    "gate_silent": Wording(
        _DOUBT, "gate silent", "{gate} gave no edges: dead or not plugged in",
        "plug the gate in, and see that it changes when a hand is in its beam"),
    "side_silent": Wording(
        _DOUBT, "gates silent", "the gates{on_side} gave no edges: dead or not plugged in",
        "plug the gates in, and see that each changes when a hand is in its beam"),
    "gate_disagrees": Wording(
        _VOID, "gate sees something else",
        "{gate} sees something else: only {share:.0%} of its expected edges are there", _BEAM),
    "gate_disagrees_few": Wording(
        _DOUBT, "gate sees something else",
        "{gate} sees something else: only {share:.0%} of its expected edges are there", _BEAM),
    "gate_off": Wording(
        _VOID, "gate off its height",
        "{gate} is off its height by {deviations:.0f} times its uncertainty", _HEIGHT),
    "rods_pile_up": Wording(
        _VOID, "rods pile up",
        "rods pile up on the surface: {gates} miss rods that higher gates see, and the last rods "
        "strike those that lie there", "incline the surface more, or use fewer rods"),
    "low_gates_miss_rods": Wording(
        _VOID, "low gates miss rods",
        "{gates} miss rods that higher gates see, though the last rods pass: rods before them "
        "strike too early, or the gate misses some",
        "let the chains hang still before the release, or put the lowest gate higher"),
    # What the fit says.
    "release_skew": Wording(
        _VOID, "release skew", "release skew {skew_s:.2f ms} exceeds the limit of {limit_s:g ms}",
        _SKEW),
    "release_skew_near": Wording(
        _DOUBT, "release skew",
        "release skew {skew_s:.2f ms} is within its uncertainty of the limit of {limit_s:g ms}",
        _SKEW),
    "scatter": Wording(
        _DOUBT, "scatter",
        "edges scatter {factor:.1f} times as much as stated; uncertainties are enlarged to match",
        LOOK),
    "not_converged": Wording(
        _DOUBT, "fit did not converge", "the fit did not converge: no motion fits these edges well",
        LOOK),
    "late_stamps": Wording(
        _DOUBT, "late time stamps", "{edges} time stamps may be late",
        "look for noise on the gates' cables: many edges came almost at once"),
    "short_pulses": Wording(
        _DOUBT, "short pulses", "{pulses} pulses were too short to be timed",
        "look for noise on the gates' cables, and shield them"),
    "air_implausible": Wording(
        _VOID, "no such fall",
        "no fall of {body} fits: even with implausible air (κ = {kappa:.2g} per m) edges scatter "
        "{factor:.1f} times as much as stated", _COMPARE),
    "air_accelerates": Wording(
        _DOUBT, "air would accelerate",
        "the fit needs air that accelerates {body} (κ = {kappa:.2g} ± {U95:.1g} per m): the clock, "
        "the gates' heights or gravity are not as stated", _COMPARE),
    "other_incline": Wording(
        _REMARK, "incline or surface",
        "the impacts (α = {alpha:.3f} ± {U95:.1g}) are those of an incline of {likelier_deg:g}°, "
        "not {stated_deg:g}°, or the surface is not as stated",
        "set the board to the run's incline, or correct the surface in the protocol"),
    "last_speed_differs": Wording(
        _DOUBT, "end of the fall",
        "the last passages alone give V = {alone}, the whole fall {whole}: the end of the fall "
        "differs from the model",
        LOOK),
    "last_separation_differs": Wording(
        _DOUBT, "end of the fall",
        "the last passages alone give Δz as it fell = {alone}, the whole fall {whole}: the end of "
        "the fall differs from the model", LOOK),
    "differs_from_session": Wording(
        _REMARK, "differs from the session",
        "only {matched} of its {alone} edges fit together with the other runs: gates or {body} "
        "may have been moved; this run is measured by itself", _COMPARE),
    # What would explain a drop.
    "unclear_fault": Wording(_VOID, "several possible faults", "possible, but not clear: {faults}",
                         _COMPARE),
    "rod_missing": Wording(
        _VOID, "rod missing",
        "no gate saw {part} {rod} of {rods} (from the bottom) of {chain}{on_side}: it is missing",
        "put the missing {part} in, or write the real spacing into the protocol"),
    "rod_count": Wording(
        _VOID, "number of rods", "{chain} has {rods} {part}s, not {stated} as the protocol says",
        "use what the protocol describes, or correct the number of rods in the protocol"),
    "chain_length": Wording(
        _VOID, "chain length",
        "{chain} is {size} {size_m:longer|shorter} than the protocol says",
        "measure the length again and correct the protocol"),
    "thickness": Wording(
        _VOID, "thickness", "{each_part} looks {size} {size_m:thicker|thinner} than the protocol "
        "says", "measure the diameter and the width of the beams again, and state what a beam sees",
    ),
    "upside_down": Wording(
        _VOID, "upside down", "{chain} hangs upside down{on_side}", "turn the chain round"),
    "chains_exchanged": Wording(
        _VOID, "chains exchanged", "chains {impact} and {free} hang on each other's side",
        "exchange the two chains, or hang them as the run asks"),
    "drop_height": Wording(
        _VOID, "drop height", "{start} {size} {size_m:higher|lower} than the protocol says",
        "measure the drop again and correct the protocol"),
    "clock": Wording(
        _VOID, "clock", "the timer's clock is {relative} {share:slow|fast}",
        "state how well the timer's clock is known, or compare it: rig import --help"),
    "air": Wording(
        _VOID, "air",
        "the air slows {body} by κ = {kappa:.2g} ± {U95:.1g} per m, not as the protocol says",
        "correct or leave out drag in the protocol, or use heavier objects"),
    "all_gates": Wording(
        _VOID, "all gates off",
        "all gates are {size} {size_m:higher|lower} above the contact point than the protocol says",
        "measure the gates from the contact point, not from the board"),
    "gravity": Wording(
        _VOID, "gravity", "gravity is {relative} {share:more|less} than the protocol says",
        "use site: with your latitude and height in the protocol"),
    "post": Wording(
        _VOID, "post off", "the {side} side's post is {size} {size_m:higher|lower} than the "
        "protocol says", "measure that post's zero against the other post's"),
    "gate_height": Wording(
        _VOID, "gate off its height",
        "{gate} is {size} {size_m:higher|lower} than the protocol says", _HEIGHT),
    "gates_exchanged": Wording(
        _VOID, "gates exchanged", "{gates} are exchanged",
        "exchange the two plugs, or their channels in the protocol"),
    "stopped": Wording(_VOID, "stopped", "{text}", _RESUME),
    "client_silent": Wording(
        _VOID, "client silent",
        "nothing was heard from {client} for {silence_s:.1f} s, so it lost control", _RESUME),
    "client_lost": Wording(_VOID, "client lost", "the client in control was lost", _RESUME),
    # What the device refuses, and why it disarms itself.
    "refused_not_armed": Wording(
        _VOID, "not armed", "the device is not armed",
        "it disarms itself when it has waited too long: arm again"),
    "refused_wrong_token": Wording(
        _VOID, "armed by another program", "the device was armed by somebody else",
        "make sure that only one program controls the device, then arm again"),
    "refused_gate_blocked": Wording(
        _VOID, "gate blocked", "{inputs} {are} blocked",
        "clear the beam, and check that its emitter has power"),
    "refused_gate_unsteady": Wording(
        _VOID, "gate unsteady", "{inputs} changed after arming",
        "let everything come to rest, check for loose plugs and stray light, then arm again"),
    "refused_bad_parameter": Wording(
        _VOID, "not possible", "the device cannot do what was asked",
        "compare gates, release and pulse of the protocol file with what the board has"),
    "refused_busy": Wording(
        _VOID, "recording", "the device is recording", "wait until the drop is over, or abort it"),
    "refused_holding_a_drop": Wording(
        _VOID, "drop held", "the device still holds the drop of run {run}",
        "read and acknowledge that drop first: resume its session"),
    "refused_no_such_drop": Wording(
        _VOID, "drop not held", "the device does not hold this drop",
        "it was acknowledged before, or lost when the board restarted: repeat the run"),
    "refused_wrong_crc": Wording(
        _VOID, "checksum wrong", "the device holds different data than was acknowledged",
        "read the drop again"),
    "refused_version": Wording(
        _VOID, "version", "the board's firmware speaks protocol version {firmware}, this program "
        "version {program}", "bring both to the same version: rig flash"),
    "refused_stopped": Wording(_VOID, "emergency stop", "the emergency stop is open", _STOP),
    "refused_cooling": Wording(
        _VOID, "release cooling", "the release must rest for {rest_s:.0f ms} more",
        "wait that long, then arm again: its coil may be on for a quarter of the time"),
    "refused_not_kept": Wording(
        _VOID, "events overwritten", "the device keeps events from number {first} on only",
        "repeat the run; a board with more memory keeps a drop whole"),
    "refused_unknown_message": Wording(
        _VOID, "request unknown", "the device does not know this request",
        "its firmware is older than this program: rig flash"),
    "disarmed_timeout": Wording(
        _VOID, "disarmed", "the device disarmed itself: it waited too long to be fired", "arm again"
    ),
    "disarmed_host_silent": Wording(
        _VOID, "disarmed", "the device disarmed itself: this program was silent for too long",
        "a busy computer, a slow disk or a bad cable does that; arm again"),
    "disarmed_stopped": Wording(
        _VOID, "emergency stop", "the device disarmed itself: the emergency stop was opened", _STOP
    ),
    # What the doctor and the self-test find.
    "packages_mixed": _finding(
        "{packages} too: files of both are in one folder",
        "python -m pip uninstall {names} chainrig, then install chainrig again"),
    "port_missing": _finding("there is no such port", "is the board plugged in? rig ports"),
    "port_forbidden": _finding(
        "not given: it belongs to the group {group}",
        f"sudo usermod -aG {{join}} $USER and log in again, or {_RULE}"),
    "port_of_root": _finding("not given: it belongs to the group root", _RULE),
    "port_in_use": _finding("{owners}", "close that program"),
    "port_of_daemon": _finding(
        "{owners}", "let that daemon do the work: rig run and rig tui ask it"),
    "modem_manager": _finding("it may speak to the board, which restarts it", _RULE),
    "firmware_differs": _finding("{firmware}, but {shipped} comes with rig", "rig flash"),
    "drop_held": _finding(
        "the board holds a drop (run {run}, attempt {attempt})",
        "continue the session it belongs to: rig run"),
    "clock_unknown": _finding(
        "the clock's rate cannot be determined from {pings} pings", f"{_CABLE}; {_FLASH}"),
    "clock_off": _finding(
        "the clock is off by {ppm:+.0f} ± {U95:.0f} ppm",
        "its resonator is broken: take another board"),
    "no_ping": _finding("no ping came through", _CABLE),
    "slow_answers": _finding(
        "answers take up to {slowest_s:.1f ms}", "close what keeps this computer busy; no USB hub"),
    "stop_open": _finding("open", "close it, or plug its cable in: it opens too"),
    "gates_blocked": _finding(
        "{gates_listed} blocked all the time",
        f"{_CLEAR}; an input without a gate reads so too: leave it, or wire it to ground"),
    "gates_flicker": _finding("changing while nothing moves: {gates_listed}", _STILL),
    "gates_flicker_mains": _finding(
        "changing while nothing moves: {gates_listed}",
        "keep lamps off the receivers and mains leads off the cables; shield the beams"),
    "disk_full": _finding(
        "{free_mb:.0f} MB free in {folder}",
        "free {needed_mb:.0f} MB there, or keep sessions elsewhere"),
    "session_missing": _finding("not there", "check its name; rig run makes a new one"),
    "no_session": _finding("not a session: {text}", "name a file made by rig run"),
    "session_damaged": _finding("damaged: {text}", "rig recover {path} -o NEW.session"),
    "board_restarts": _finding(
        "{text}", f"{SUPPLY} Give them one of their own, and check {WIRING}"),
    "failed": _finding("{text}", "{hint}"),
    "no_answer": _finding("no answer to {request}", f"{_CABLE}; {_FLASH}"),
    "wrong_answer": _finding("{request} should give {expected}, but gives {answer}", _FLASH),
    "invalid_message": _finding("the board sent an invalid message: {text}", _FLASH),
    "fire_withheld": _finding("FIRE was not sent, because a release may be armed", _FLASH),
    "sync_blocked": _finding("gate {gate} is not clear before FIRE", _LOOPBACK),
    "sync_edges": _finding(
        "FIRE made {events} events at gate {gate} instead of one edge", _LOOPBACK),
    "sync_late": _finding("{latency}: more than the board's own {ticks} ticks", _FLASH),
    "computer_busy": _finding(
        "this computer was too busy to ask the board every {interval_s:.0f ms}",
        "close what keeps it busy, then rig selftest again"),
    "check_needs": _finding("it needs {needed}"),
    # What an import assumes of another timer's file.
    "samples": _remark(
        "sampled every {period_us:.4g} µs: an edge is known to {u_us:.3g} µs "
        "at best; state that as priors: {{jitter: ...}} in the protocol if it is more than 2 µs"),
    "inputs_unused": _remark("inputs that are no gate: {inputs}; see --map"),
    "columns_unused": _remark("not used: {columns}"),
    "no_passage": _remark("{input}: nothing passes, {low:.3g} to {high:.3g}"),
    "crossings": _remark("{input}: {crossings} crossings of {level:.3g}"),
    "several_drops": _remark("split into {drops} drops at pauses longer than {pause_s:g} s"),
    "blocked_level": _remark(
        "assumed: a {level} signal is a blocked beam, because beams are "
        "clear at the beginning; --dark {other} reverses this"),
    # Words of people and of old files.
    OPERATOR: Wording(_VOID, "rejected by the operator", "{text}"),
    NOTE: Wording(_REMARK, "note", "note: {text}"),
    SENTENCE: Wording(_VOID, "", "{text}", LOOK),
}  # fmt: skip
"""What the program says of each code."""
