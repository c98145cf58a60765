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

_CLIENTS = "close clients that nobody needs, or try again in a few seconds"
_DISK = "STOP still goes out to the board; look at the disk (full, on a network, failing?)"
_UNKNOWN = "for {late_s:.0f} s: gates, phase and drop are not known meanwhile"
_OFF = "; what was armed switches itself off after 0.25 s"
_DISCARD = "taking the power from the board discards the drop, a reset does not"
_PORTS = "`rig ports` lists what is there"
_RECOVER = "rig recover says what is whole, and with -o NEW saves all that can be read"
_SESSION_FILE = "name a file made by rig run, rig import or rig daemon"

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
    "rods_lie": _doubt(
        "rods strike others, which lie up to about {height_m:.0f mm} ± {U95_m:.0f mm} above the "
        "contact point: lower beams see part of the fall, and what is at level is extrapolated; "
        "use what is at strike",
        "incline the surface more, or use fewer or thinner rods", label="rods lie there"),
    "rods_hide_end": _void(
        "rods strike others, which lie up to about {height_m:.0f mm} ± {U95_m:.0f mm} above the "
        "contact point: no beam is high enough above them to see how the fall ends",
        "put a gate of the impact side higher, or incline the surface more"),
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
    "durations": _doubt(
        "{numbers} are durations, or something else, and not the times of passages",
        "these are durations, not moments: use a column of the times themselves, as the timer "
        "counted them"),
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
    "run_unplanned": _doubt(
        "run {run} is not in the plan of {protocol}, which has {planned:run}",
        "raise plan.repeats, or number the runs as the plan does"),
    "several_readings": _doubt(
        "the file may be read in more than one way", "decide with {options}"),
    "no_reading_fits": _doubt(
        "at most {share:.0f} % of a run's edges are where a fall of this protocol puts them",
        "are protocol, unit, states and runs right? otherwise decide with {options}"),
    "more_edges": _doubt(
        "run {run} has {count:edge} at channel {channel}; the object makes at most {most}",
        "say which input is which gate with --map, or take the file as it is with --as-read"),
    "one_wire": _doubt(
        "the file has a single input, with the edges of all gates",
        "if the gates are on a single wire, say so: {option}"),
    "at_once": _doubt(
        "two inputs change at the same time in line {line}",
        "is a row missing? otherwise take the file as it is with --as-read"),
    "rows_unused": _doubt(
        "{unused} of {rows:row} unused: lines {lines}",
        "--allow-unused leaves them out; --map says which input is which gate"),
    "layout_unclear": _doubt(
        "not how a file is read: {text}",
        "accepted: unit (s, ms, us, ns), dark (high, low, states, inverted, turns, turns-clear, "
        "each), groups (runs, gates, passing), pause_s (0 to 3600), channels ({{INPUT: CHANNEL}})"),
    "no_session_file": _doubt("no file is named", "--session FILE, or --dry-run to look first"),
    # What an import assumes of another timer's file.
    "samples": _remark(
        "sampled every {period_us:.4g} µs: an edge is known to {u_us:.3g} µs at best; state that "
        "as priors: {{jitter: ...}} in the protocol if it is more than 2 µs"),
    "rows_used": _remark("{runs:run}, {rows:row}: {edges:edge}; {silent:row} without a change"),
    "rows_left_out": _remark(
        "{runs:run}, {rows:row}: {edges:edge}; {unused:row} unused: lines {lines}"),
    "falls_fit": _remark("{runs:run}: {near} of {due:edge} where a fall puts them"),
    "same_twice": _doubt(
        "run {run} has the same times as run {other}",
        "is it a copy? leave it out, or take the file as it is with --as-read"),
    "reading_chosen": _remark("read as {option}: {fit}"),
    "gates_absent": _remark("the file has nothing of the gates at channels {channels}"),
    "inputs_unused": _remark("inputs that are no gate: {inputs}; see --map"),
    "channels_unused": _remark("edges of channels {channels} are kept but belong to no gate"),
    "columns_unused": _remark("not used: {columns}"),
    "no_passage": _remark("{input}: nothing passes, {low:.3g} to {high:.3g}"),
    "crossings": _remark("{input}: {crossings} crossings of {level:.3g}"),
    "several_drops": _remark("split into {drops:drop} at pauses longer than {pause_s:g} s"),
    "blocked_level": _remark(
        "assumed: a {level} signal is a blocked beam, because beams are clear at the beginning; "
        "--dark {other} reverses this"),
    # What daemon, recorder, session and link refuse.
    "no_gates": _void("{source} has no gates, so nothing can be measured",
        "add the gates that are there, at any heights; rig predict {source} needs none"),
    "daemon_gone": _void("the daemon is gone: {text}",
        "start it again (rig daemon), then give the same command: a drop that fell is fetched"),
    "daemon_silent": _void("the daemon at {path} did not answer within {patience_s:g} s",
        "the computer is very busy, or the daemon hangs: try again, or stop it and start it again"),
    "daemon_no_answer": _void("the daemon does not answer {method}", "stop it and start it again"),
    "daemon_version": _void(
        "this client speaks version {client} of the daemon's interface; rig {rig}'s daemon speaks "
        "version {daemon}",
        "stop the daemon and start it again after an update; update the client"),
    "daemon_busy": _void("the daemon at {path} is busy: for {patience_s:g} s it took no new client",
        "try again; if it stays so, stop it and start it again"),
    "daemon_there": _void("another daemon answers at {path}",
        "use that daemon, stop it, or name another place with --socket"),
    "daemon_ends": _void("the daemon ends", "start it again: rig daemon"),
    "daemon_port": _void("the daemon has {port}, not {wanted}",
        "give --port {port}, or name another daemon's place with --socket"),
    "no_daemon": _void("no daemon at {path}: {text}", "start one: rig daemon"),
    "daemon_foreign": _void(
        "the daemon at {path} belongs to another user", "start one of your own: rig daemon"),
    "not_a_daemon": _void("the program that answers there is not a daemon of this rig",
        "name the daemon's place with --socket"),
    "not_understood": _void("the daemon does not understand: {text}", "are both of one version?"),
    "internal_error": _void(
        "internal error", "this is a bug, please report it with the daemon's log"),
    "file_failed": _void("{path}: {text}", "name another file"),
    "socket_lost": _void(
        "{path} was deleted, moved or replaced: no client finds this daemon, so it ended",
        "its last words are in {folder}; start it again"),
    "place_unusable": _void("cannot use {path}: {text}", "name another place with --socket"),
    "folder_foreign": _void("{folder} belongs to another user", "name another place with --socket"),
    "folder_open": _void("{folder} is open to other users",
        "name a place in a folder of your own with --socket; if this folder is for nothing else: "
        "chmod 700 {folder}"),
    "clients_full": _void("{clients} clients are connected", _CLIENTS),
    "clients_only_stop": _void(
        "{clients} clients are connected: any further client may only stop", _CLIENTS),
    "connections_silent": _void("the daemon has too many connections that say nothing", _CLIENTS),
    "requests_full": _void(
        "{requests} requests of this client wait already", "wait for their answers"),
    "hello_late": _void(
        "nothing of use was asked for {patience_s:g} s", "say hello as soon as connected"),
    "control_held": _void(
        "{holder} has control", "let it finish, or close it; watching and STOP work meanwhile"),
    "control_lost": _void(
        "control was lost: nothing was heard from this program for {silence_s:.1f} s, and "
        "{holder} has it now",
        "when {holder} has finished, give the same command again: it continues from here"),
    "control_needed": _void("this needs control, and {holder} has it",
        "take control first; where somebody else has it, let them finish"),
    "stop_unknown": _void(
        "STOP went out to the board; it is not known yet whether the board heard it{because}",
        "a board that is not heard of switches its release off by itself, after 0.25 s"),
    "disk_slow": _void(f"the disk has been at one write {_UNKNOWN}", _DISK),
    "disk_slow_armed": _void(f"the disk has been at one write {_UNKNOWN}{_OFF}", _DISK),
    "held_up": _void(f"the daemon has been held up {_UNKNOWN}", _DISK),
    "held_up_armed": _void(f"the daemon has been held up {_UNKNOWN}{_OFF}", _DISK),
    "records_waiting": _void(
        "records wait for the disk", "what is waiting is kept in memory until it can be written"),
    "no_connection": _void("there is no connection to the device", "wait until it is back"),
    "no_session_open": _void("no session is open", "open a session first"),
    "not_now": _void("this is not the moment to {act}", "open a session; finish the drop"),
    "not_next": _void("run {run}, attempt {attempt} does not come next",
        "read the session again: another client may have continued it"),
    "nothing_armed": _void("nothing is armed", "arm first"),
    "not_recorded": _void("there is no record of run {run}, attempt {attempt}", "repeat the run"),
    "cannot_judge": _void("run {run}, attempt {attempt} cannot be {state}",
        "only the latest attempt is judged, when it is recorded"),
    "switched_off": _void("everything was switched off", "arm again when all is well"),
    "release_test_stopped": _void("the test of the release was stopped", "the release is off"),
    "drop_of_another_session": _void(
        "the device holds a drop (run {run}, attempt {attempt}) of another session",
        f"continue that session first; {_DISCARD}"),
    "drop_differs": _void(
        "the device holds another drop of run {run}, attempt {attempt}, than this session",
        f"continue the session it belongs to; {_DISCARD}"),
    "other_board": _void("another board is at {port} ({difference})",
        "plug the board of this session in again; to continue with the board that is there, give "
        "the same rig run command again"),
    "other_protocol": _void("{path} was made with another protocol ({source})",
        "give the same protocol file to continue it, or a new session file"),
    "session_mixed": _void("{path} is a {recorded} session and {port} is {kind}",
        "the two are never mixed: give a new session file"),
    "device_silent": _void("the device did not answer {request}",
        "check cable and power, press the board's reset button; no firmware yet? rig flash"),
    "device_confused": _void(
        "the device answered {request} with {answer}", "is this the rig's own board? rig selftest"),
    "device_endless": _void("the device records and never ends", "abort the drop; rig selftest"),
    "events_not_sent": _void("the device did not send the events it was asked for",
        "its firmware is faulty: rig flash, then rig selftest"),
    "board_restarted": _void(
        "the board restarted", f"check its power supply and {WIRING}, then connect again"),
    "board_restarted_in_drop": _void(f"the board restarted {{moment}}: {SUPPLY}",
        f"give the magnets a supply of their own, and check {WIRING}"),
    "connection_lost": _void("connection lost: {text}",
        "check the cable; plugged in again, the board is found by its serial number, and the "
        "same rig run goes on: a drop that fell is fetched"),
    "bytes_strange": _void("{size_mb:.1f} MB of bytes {lacking}",
        "another baud rate, or another program's port? rig ports lists what is there"),
    "no_port": _void(
        "cannot open {port}: there is no such port", f"is the board plugged in? {_PORTS}"),
    "port_denied": _void("cannot open {port}: permission denied",
        "join the group that owns it (often dialout), log in again"),
    "port_taken": _void("cannot open {port}: another program uses it",
        "close that program, or let its daemon do the work"),
    "port_failed": _void("cannot open {port}: {text}", _PORTS),
    "port_unreachable": _void("cannot open {port}: {text}",
        "is the program that passes the port on running there, and does a firewall let it? As a "
        "URL: socket://HOST:PORT"),
    "emulator_missing": _void("the emulator is not installed, or is broken",
        "install it: pip install ./firmware/emulator (needs gcc and Debian's libsimavr-dev)"),
    "not_a_port": _void("{port} is no port: {text}", "a device path, or a URL such as sim://"),
    "disk_knows_no_locks": _void("cannot lock {path}: its disk knows no locks",
        "is it on a network? Put the session on a disk of this computer, and copy it when all is "
        "done"),
    "cannot_lock": _void("cannot lock {path}: {text}",
        "a session needs a folder you may write to; copy it to one, or only read it"),
    "session_in_use": _void("{path} is being written by {holder}",
        "stop that program first, use its daemon, or open the session read-only"),
    # Several sessions together.
    "sessions_unlike": _void(
        "{path} has another kind of scene, or other priors, than {other}",
        "add and compare sessions of one kind of scene and of like `priors`"),
    "sessions_disagree": _void(
        "no joint fit holds for {names}: they do not have the same rig",
        "tell rigs apart with --no-same-rig, or analyse each session by itself"),
    "package_absent": _void(
        "this needs {package}, which is not installed",
        "pip install 'chainrig[notebook]', or that package alone"),
    "nothing_to_compare": _void(
        "no session has runs at an incline of {path}",
        "compare sessions that have at least one incline in common"),
    "option_for_one_session": _void(
        "{options}: for one session only", "name one session, or leave these options out"),
    "option_for_several_sessions": _void(
        "{options}: for several sessions only", "name more sessions, or leave these options out"),
    "session_repeated": _void(
        "{path} repeats {other}: {drops} drops are the same",
        "name each session once; a copy and its original are one session"),
    "session_blind": _void(
        "{path} is blind, as its protocol says: its numbers are kept back",
        "when all drops are judged, once and for good: rig unblind {path}"),
    "records_damaged": _void("{path} has {records}", _RECOVER),
    "session_unfinished": _void(
        "{path} is unfinished: {missing} of {planned} planned runs are not recorded",
        "continue it with rig run, or accept what there is with --unfinished"),
    "session_no_results": _void(
        "{path} has no good run", "rig analyze {path} says why its runs do not count"),
    "session_two_names": _void("{path} has a second name (a hard link)",
        "both would be written at once: copy it to a new file, and use that file"),
    "session_there": _void(
        "{path} already exists", "choose another name, or continue that session"),
    "session_absent": _void(
        "no session at {path}: {text}", "rig run, rig import and rig daemon make one"),
    "session_unmade": _void("cannot make {path}: {text}", "choose a folder you may write to"),
    "session_unreadable": _void("cannot read {path}: {text}",
        "check its name and permissions, and that there is room for a copy in TMPDIR"),
    "session_newer": _void(
        "{path} was written by a newer rig (format {format}; this rig knows up to {known})",
        "update rig to open it"),
    "session_altered": _void("{path} was built or altered by another program: {text}", _RECOVER),
    "not_a_session": _void("{path} is not a session file: {text}", _SESSION_FILE),
    "session_wrong": _void("{path}: {text}", _RECOVER),
    "session_closed": _void("{path} is closed", "open it again"),
    "session_read_only": _void("{path} is open read-only", "open it for writing"),
    "session_unsaved": _void(
        "{trouble} while it was in use, and could not be saved anywhere: {text}",
        "what was not committed is lost; a drop that fell is still on the board: make room, and "
        "give the same command with a new session file"),
    "session_rescued": _void(
        "{trouble} while it was in use; everything that was recorded is saved as "
        "{place}{except_for}",
        "give that name to the same command, and it goes on; look for what moves or deletes "
        "sessions (a sync or backup program?)"),
    # What SQLite says of a session, with its own words in brackets.
    "sqlite_full": _void("the disk is full while writing {path} ({text})",
        "free some space, then the same command goes on: nothing committed is lost, and a drop "
        "that fell is still on the board"),
    "sqlite_ioerr": _void("the disk failed under {path} ({text})",
        "check the disk and its cable, copy the session to another disk, then open the copy"),
    "sqlite_readonly": _void("{path} cannot be written ({text})",
        "check the permissions of the file and its folder, or work on a copy"),
    "sqlite_cantopen": _void(
        "{path} cannot be opened ({text})", "check the permissions of the file and its folder"),
    "session_locked": _void("{path} is locked by another program ({text})",
        "close the program that has the session open and try again"),
    "sqlite_corrupt": _void("{path} is damaged ({text})", _RECOVER),
    "sqlite_interrupt": _void("{path} takes far longer to read than any session ({text})",
        "it was altered or is damaged: rig recover says what is whole"),
    "sqlite_constraint": _void("{path} refuses this record ({text})",
        "raw records are added once and never altered; record a new attempt instead"),
    "sqlite_failed": _void("{path} cannot be read ({text})", _RECOVER),
    # Words of people and of old files.
    OPERATOR: _void("{text}", label="rejected by the operator"),
    NOTE: _remark("note: {text}"),
    SENTENCE: _void("{text}", LOOK),
}  # fmt: skip
"""What the program says of each code."""
