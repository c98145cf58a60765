"""The one table of what the program says of each code: how bad it is, its label, sentence, remedy.

`rig.reasons` fills in values and the words of a scene; sentences are written here, never read back.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from functools import partial

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
    sentence
        With places for values, see `_Phrases`.
    remedy
        What to do about it; empty where nothing is to be done.
    label
        In a few words, where several drops have it; empty where the code says it.
    """

    severity: Severity
    sentence: str
    remedy: str = ""
    label: str = ""


_void = partial(Wording, Severity.VOID)
_doubt = partial(Wording, Severity.DOUBT)
_remark = partial(Wording, Severity.REMARK)
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
_LOOPBACK = "check the wire from the sync output to gate {gate}"
_RULE = (
    "python -m rig.usb.udev | sudo tee /etc/udev/rules.d/60-chainrig.rules, then "
    "sudo udevadm control --reload and sudo udevadm trigger"
)

WORDINGS: dict[str, Wording] = {
    # The record.
    "edges_lost": _void(
        "the board lost {lost} edges because its memory was full",
        "find the gate that flickers, then shield or unplug it"),
    "no_identity": _void("the board never identified itself, so its tick rate is unknown", _BOARD),
    "restarted": _void("the board restarted before the drop was read", _BOARD),
    "no_certificate": _void("no certificate: the board did not close the record", _BOARD),
    "events_missing": _void("{missing} of {events} events missing, from number {first}", _BOARD),
    "events_overwritten": _void(
        "{missing} of {events} events no longer kept by the board, from number {first}", _BOARD),
    "crc_mismatch": _void(
        "the events do not match the certificate's CRC-32", _BOARD, label="checksum wrong"),
    "record_damaged": _void(
        "damaged: {text}; see rig recover SESSION",
        "rig recover SESSION says what is whole, and with -o NEW saves it"),
    "record_torn": _void("a part of the record was lost with its file", "measure this run again"),
    "pulse_cut": _void(
        "the release pulse ended after {lasting_s:.3g ms}: the board found it out of order",
        "look for a short circuit at the release's output; rig selftest tests it"),
    "pulse_stopped": _void(
        "the release pulse ended after {lasting_s:.3g ms}: the emergency stop opened",
        "drop again; if nobody opened the stop, shield its cable and put 47 nF across it at the "
        "board"),
    "pulse_aborted": _void(
        "the release pulse ended after {lasting_s:.3g ms}: the drop was aborted", _AGAIN),
    "connection_ended": _void("the connection ended before the drop was recorded", _AGAIN),
    # Which edge is what.
    "few_edges_fit": _void(
        "only {share:.0%} of the expected edges{on_side} fit a fall of {body}", _COMPARE),
    "no_fall": _void("no fall of {body} fits enough of the edges", _COMPARE),
    "two_falls": _void(
        "two falls fit these edges: the likelier has odds of {odds:.3g} to 1",
        "add or move a gate; rig check PROTOCOL says how many simulated drops are identified then"),
    "two_falls_gate": _void(
        "two falls fit these edges: the likelier has odds of {odds:.3g} to 1; one more gate at "
        "{height_m:.0f mm}{on_side} would decide",
        "put a gate there, or move one; rig check PROTOCOL says how many simulated drops are "
        "identified then", label="two falls"),
    "edges_missed": _void(
        "{missed} of {expected} edges missed ({share_of_edges}), limit {limit:.1%}", _MISSED),
    "edges_missed_few": _doubt(
        "{missed} of {expected} edges missed ({share_of_edges}), limit {limit:.1%}; of so few "
        "edges this may be chance", _MISSED, label="edges missed"),
    "edges_unexplained": _void(
        "{unexplained} of {received} edges unexplained ({share_of_edges}), limit {limit:.1%}",
        _STRAY),
    "edges_unexplained_few": _doubt(
        "{unexplained} of {received} edges unexplained ({share_of_edges}), limit {limit:.1%}; "
        "this may be one stray pulse", _STRAY, label="edges unexplained"),
    "later_passages": _remark("{edges} edges after the passage were left out: {body} came back"),
    # Gates.
    "gate_silent": _doubt(
        "{gate} gave no edges: dead or not plugged in",
        "plug the gate in, and see that it changes when a hand is in its beam"),
    "side_silent": _doubt(
        "the gates{on_side} gave no edges: dead or not plugged in",
        "plug the gates in, and see that each changes when a hand is in its beam"),
    "gate_disagrees": _void(
        "{gate} sees something else: only {share:.0%} of its expected edges are there", _BEAM),
    "gate_disagrees_few": _doubt(
        "{gate} sees something else: only {share:.0%} of its expected edges are there", _BEAM,
        label="gate disagrees"),
    "gate_off": _void(
        "{gate} is off its height by {deviations:.0f} times its uncertainty", _HEIGHT),
    "rods_pile_up": _void(
        "rods pile up on the surface: {gates} miss rods that higher gates see, and the last rods "
        "strike those that lie there",
        "incline the surface more, or use fewer rods"),
    "low_gates_miss_rods": _void(
        "{gates} miss rods that higher gates see, though the last rods pass: rods before them "
        "strike too early, or the gate misses some",
        "let the chains hang still before the release, or put the lowest gate higher"),
    # What the fit says.
    "release_skew": _void(
        "release skew {skew_s:.2f ms} exceeds the limit of {limit_s:g ms}", _SKEW),
    "release_skew_near": _doubt(
        "release skew {skew_s:.2f ms} is within its uncertainty of the limit of {limit_s:g ms}",
        _SKEW, label="release skew"),
    "scatter": _doubt(
        "edges scatter {factor:.1f} times as much as stated; uncertainties are enlarged to match",
        LOOK),
    "not_converged": _doubt("the fit did not converge: no motion fits these edges well", LOOK),
    "late_stamps": _doubt(
        "{edges} time stamps may be late",
        "look for noise on the gates' cables: many edges came almost at once"),
    "short_pulses": _doubt(
        "{pulses} pulses were too short to be timed",
        "look for noise on the gates' cables, and shield them"),
    "air_implausible": _void(
        "no fall of {body} fits: even with implausible air (κ = {kappa:.2g} per m) edges scatter "
        "{factor:.1f} times as much as stated", _COMPARE),
    "air_accelerates": _doubt(
        "the fit needs air that accelerates {body} (κ = {kappa:.2g} ± {U95:.1g} per m): the "
        "clock, the gates' heights or gravity are not as stated", _COMPARE),
    "other_incline": _remark(
        "the impacts (α = {alpha:.3f} ± {U95:.1g}) are those of an incline of {likelier_deg:g}°, "
        "not {stated_deg:g}°, or the surface is not as stated",
        "set the board to the run's incline, or correct the surface in the protocol"),
    "last_speed_differs": _doubt(
        "the last passages alone give V = {alone}, the whole fall {whole}: the end of the fall "
        "differs from the model", LOOK),
    "last_separation_differs": _doubt(
        "the last passages alone give Δz as it fell = {alone}, the whole fall {whole}: the end of "
        "the fall differs from the model", LOOK),
    "differs_from_session": _remark(
        "only {matched} of its {alone} edges fit together with the other runs: gates or {body} "
        "may have been moved; this run is measured by itself", _COMPARE),
    # What would explain a drop.
    "unclear_fault": _void("possible, but not clear: {faults}", _COMPARE),
    "rod_missing": _void(
        "no gate saw {part} {rod} of {rods} (from the bottom) of {chain}{on_side}: it is missing",
        "put the missing {part} in, or write the real spacing into the protocol"),
    "rod_count": _void(
        "{chain} has {rods} {part}s, not {stated} as the protocol says",
        "use what the protocol describes, or correct the number of rods in the protocol"),
    "chain_length": _void(
        "{chain} is {size} {size_m:longer|shorter} than the protocol says",
        "measure the length again and correct the protocol"),
    "thickness": _void(
        "{each_part} looks {size} {size_m:thicker|thinner} than the protocol says",
        "measure the diameter and the width of the beams again, and state what a beam sees"),
    "upside_down": _void("{chain} hangs upside down{on_side}", "turn the chain round"),
    "chains_exchanged": _void(
        "chains {impact} and {free} hang on each other's side",
        "exchange the two chains, or hang them as the run asks"),
    "drop_height": _void(
        "{start} {size} {size_m:higher|lower} than the protocol says",
        "measure the drop again and correct the protocol"),
    "clock": _void(
        "the timer's clock is {relative} {share:slow|fast}",
        "state how well the timer's clock is known, or compare it: rig import --help"),
    "air": _void(
        "the air slows {body} by κ = {kappa:.2g} ± {U95:.1g} per m, not as the protocol says",
        "correct or leave out drag in the protocol, or use heavier objects"),
    "all_gates": _void(
        "all gates are {size} {size_m:higher|lower} above the contact point than the protocol says",
        "measure the gates from the contact point, not from the board", label="all gates off"),
    "gravity": _void(
        "gravity is {relative} {share:more|less} than the protocol says",
        "use site: with your latitude and height in the protocol"),
    "post": _void(
        "the {side} side's post is {size} {size_m:higher|lower} than the protocol says",
        "measure that post's zero against the other post's", label="post off"),
    "gate_height": _void("{gate} is {size} {size_m:higher|lower} than the protocol says", _HEIGHT),
    "gates_exchanged": _void(
        "{gates} are exchanged", "exchange the two plugs, or their channels in the protocol"),
    "stopped": _void("{text}", _RESUME),
    "client_silent": _void(
        "nothing was heard from {client} for {silence_s:.1f} s, so it lost control", _RESUME),
    "client_lost": _void("the client in control was lost", _RESUME),
    # What the device refuses, and why it disarms itself.
    "refused_not_armed": _void(
        "the device is not armed", "it disarms itself when it has waited too long: arm again"),
    "refused_wrong_token": _void(
        "the device was armed by somebody else",
        "make sure that only one program controls the device, then arm again"),
    "refused_gate_blocked": _void(
        "{inputs} {are} blocked", "clear the beam, and check that its emitter has power"),
    "refused_gate_unsteady": _void(
        "{inputs} changed after arming",
        "let everything come to rest, check for loose plugs and stray light, then arm again"),
    "refused_bad_parameter": _void(
        "the device cannot do what was asked",
        "compare gates, release and pulse of the protocol file with what the board has"),
    "refused_busy": _void("the device is recording", "wait until the drop is over, or abort it"),
    "refused_holding_a_drop": _void(
        "the device still holds the drop of run {run}",
        "read and acknowledge that drop first: resume its session"),
    "refused_no_such_drop": _void(
        "the device does not hold this drop",
        "it was acknowledged before, or lost when the board restarted: repeat the run"),
    "refused_wrong_crc": _void(
        "the device holds different data than was acknowledged", "read the drop again"),
    "refused_version": _void(
        "the board's firmware speaks protocol version {firmware}, this program version {program}",
        "bring both to the same version: rig flash"),
    "refused_stopped": _void("the emergency stop is open", _STOP),
    "refused_cooling": _void(
        "the release must rest for {rest_s:.0f ms} more",
        "wait that long, then arm again: its coil may be on for a quarter of the time"),
    "refused_not_kept": _void(
        "the device keeps events from number {first} on only",
        "repeat the run; a board with more memory keeps a drop whole"),
    "refused_unknown_message": _void(
        "the device does not know this request",
        "its firmware is older than this program: rig flash"),
    "disarmed_timeout": _void(
        "the device disarmed itself: it waited too long to be fired", "arm again"),
    "disarmed_host_silent": _void(
        "the device disarmed itself: this program was silent for too long",
        "a busy computer, a slow disk or a bad cable does that; arm again"),
    "disarmed_stopped": _void("the device disarmed itself: the emergency stop was opened", _STOP),
    # What the doctor and the self-test find.
    "packages_mixed": _doubt(
        "{packages} too: files of both are in one folder",
        "python -m pip uninstall {names} chainrig, then install chainrig again"),
    "port_missing": _doubt("there is no such port", "is the board plugged in? rig ports"),
    "port_forbidden": _doubt(
        "not given: it belongs to the group {group}",
        f"sudo usermod -aG {{join}} $USER and log in again, or {_RULE}"),
    "port_of_root": _doubt("not given: it belongs to the group root", _RULE),
    "port_in_use": _doubt("{owners}", "close that program"),
    "port_of_daemon": _doubt("{owners}", "let that daemon do the work: rig run and rig tui ask it"),
    "modem_manager": _doubt("it may speak to the board, which restarts it", _RULE),
    "firmware_differs": _doubt("{firmware}, but {shipped} comes with rig", "rig flash"),
    "drop_held": _doubt(
        "the board holds a drop (run {run}, attempt {attempt})",
        "continue the session it belongs to: rig run"),
    "clock_unknown": _doubt(
        "the clock's rate cannot be determined from {pings} pings", f"{_CABLE}; {_FLASH}"),
    "clock_off": _doubt(
        "the clock is off by {ppm:+.0f} ± {U95:.0f} ppm",
        "its resonator is broken: take another board"),
    "no_ping": _doubt("no ping came through", _CABLE),
    "slow_answers": _doubt(
        "answers take up to {slowest_s:.1f ms}", "close what keeps this computer busy; no USB hub"),
    "stop_open": _doubt("open", "close it, or plug its cable in: it opens too"),
    "gates_blocked": _doubt(
        "{gates_listed} blocked all the time",
        f"{_CLEAR}; an input without a gate reads so too: leave it, or wire it to ground"),
    "gates_flicker": _doubt("changing while nothing moves: {gates_listed}", _STILL),
    "gates_flicker_mains": _doubt(
        "changing while nothing moves: {gates_listed}",
        "keep lamps off the receivers and mains leads off the cables; shield the beams"),
    "disk_full": _doubt(
        "{free_mb:.0f} MB free in {folder}",
        "free {needed_mb:.0f} MB there, or keep sessions elsewhere"),
    "session_missing": _doubt("not there", "check its name; rig run makes a new one"),
    "no_session": _doubt("not a session: {text}", "name a file made by rig run"),
    "session_damaged": _doubt("damaged: {text}", "rig recover {path} -o NEW.session"),
    "board_restarts": _doubt("{text}", f"{SUPPLY} Give them one of their own, and check {WIRING}"),
    "failed": _doubt("{text}", "{hint}"),
    "no_answer": _doubt("no answer to {request}", f"{_CABLE}; {_FLASH}"),
    "wrong_answer": _doubt("{request} should give {expected}, but gives {answer}", _FLASH),
    "invalid_message": _doubt("the board sent an invalid message: {text}", _FLASH),
    "fire_withheld": _doubt("FIRE was not sent, because a release may be armed", _FLASH),
    "sync_blocked": _doubt("gate {gate} is not clear before FIRE", _LOOPBACK),
    "sync_edges": _doubt("FIRE made {events} events at gate {gate} instead of one edge", _LOOPBACK),
    "sync_late": _doubt("{latency}: more than the board's own {ticks} ticks", _FLASH),
    "computer_busy": _doubt(
        "this computer was too busy to ask the board every {interval_s:.0f ms}",
        "close what keeps it busy, then rig selftest again"),
    "check_needs": _doubt("it needs {needed}"),
    # What is wrong with a timer's file, beside its line and column.
    "not_accepted": _doubt("{text!r:.40} is not {accepted}"),
    "backwards": _doubt("{text} is before the time above it"),
    "before_last": _doubt(
        "{text} is before {last}, the last time of channel {channel} in run {run}"),
    "too_long": _doubt(
        "{recording} would last {lasting_s:.0f} s; at most {limit_s:g} s are accepted",
        "is the unit of time right? passages of several drops are split at pauses"),
    "too_large": _doubt(
        "{size_mb:.0f} MB is more than {limit_mb:.0f} MB",
        "is it the right file? otherwise split it by runs"),
    "no_edges": _doubt("no edges in this file"),
    "nothing_passes": _doubt("nothing passes in this file{notes}"),
    "unreadable": _doubt("cannot read this file: {text}"),
    "not_csv": _doubt("not CSV: {text}"),
    "not_text": _doubt(
        "this is no text: a spreadsheet, or a program's own format?", "export it as text or CSV"),
    "open_quote": _doubt("a quoted value runs over the end of its line"),
    "wrong_header": _doubt("the header must be {header}"),
    "wrong_width": _doubt("{values} values where there must be {needed}: {header}"),
    "no_heading": _doubt(
        "{columns} columns without a heading, so it is not clear which are times",
        "write a heading, such as time (s),channel,state"),
    "no_time_column": _doubt("no column of this heading is a time"),
    "too_many_columns": _doubt("{columns} columns; at most {limit} are read"),
    "ambiguous": _doubt(
        "{column!r:.40} may be {readings}", "name it channel, run or state, or leave it out"),
    "unit_missing": _doubt(
        "whole numbers without a unit: seconds, or counts of a clock?", "say --unit ms or us"),
    "durations": _doubt(
        "{numbers} are durations, or something else, and not the times of passages",
        "import the times themselves, as the timer counted them"),
    "regular_samples": _doubt(
        "samples at regular times, as from video or a sensor ({columns})",
        "import the times at which gates change, or samples of gates in volts; if these are "
        "passages nevertheless, leave the other columns out"),
    "no_rate": _doubt("samples without {lacks}"),
    "no_track": _doubt("no columns t, x and y"),
    "few_frames": _doubt(
        "{frames} frames one after the other; at least {needed} are needed",
        "track one object over one fall, each frame once"),
    "inputs_unclear": _doubt(
        "the file's inputs {inputs} are not the gates' channels {channels}",
        "say which is which: --map '{pairs}'"),
    "which_gate": _doubt(
        "the file does not say which gate its times are of", "--channel N says which: {channels}"),
    "no_gates": _doubt("the scene has no gates", "add the gates that the edges come from"),
    "run_unplanned": _doubt(
        "run {run} is not in the plan of {protocol}, which has {planned} runs",
        "raise plan.repeats, or number the runs as the plan does"),
    "no_session_file": _doubt("no file is named", "--session FILE, or --dry-run to look first"),
    # What an import assumes of another timer's file.
    "samples": _remark(
        "sampled every {period_us:.4g} µs: an edge is known to {u_us:.3g} µs at best; state that "
        "as priors: {{jitter: ...}} in the protocol if it is more than 2 µs"),
    "inputs_unused": _remark("inputs that are no gate: {inputs}; see --map"),
    "channels_unused": _remark("edges of channels {channels} are kept but belong to no gate"),
    "columns_unused": _remark("not used: {columns}"),
    "no_passage": _remark("{input}: nothing passes, {low:.3g} to {high:.3g}"),
    "crossings": _remark("{input}: {crossings} crossings of {level:.3g}"),
    "several_drops": _remark("split into {drops} drops at pauses longer than {pause_s:g} s"),
    "blocked_level": _remark(
        "assumed: a {level} signal is a blocked beam, because beams are clear at the beginning; "
        "--dark {other} reverses this"),
    # Words of people and of old files.
    OPERATOR: _void("{text}", label="rejected by the operator"),
    NOTE: _remark("note: {text}"),
    SENTENCE: _void("{text}", LOOK),
}  # fmt: skip
"""What the program says of each code."""
