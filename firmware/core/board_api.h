/* What the core asks of a board: its `board.h` brings all of this, as macros, tables and functions
 * (inline or not). The core includes this file and never `board.h` itself; whatever is missing or
 * of another type ends the compilation here, by name.
 *
 * Times are ticks of a counter that goes on at BOARD_HZ. Stamps and counts are its lower 16 bits,
 * which the core makes longer (ticks.h); it looks at the counter often enough. Everything is called
 * from the main loop, and nothing may wait for longer than some microseconds. */
#ifndef BOARD_API_H
#define BOARD_API_H

#include <stdbool.h>
#include <stdint.h>

#include "board.h"

#define NEEDS(given, what) _Static_assert(given, "board.h must bring " what)
#define NEEDS_FUNCTION(name, type, what) NEEDS(_Generic(&name, type: 1, default: 0), what)

/* -- what the board is */

/* BOARD_HZ: ticks a second, a whole number in a microsecond.
 * BOARD_CAPACITY: entries of six bytes in `events_memory` (events.h).
 * BOARD_STREAMS: 1 where that memory is a ring and the latest events are kept, else 0.
 * BOARD_GATES, BOARD_GATE_MASK: how many gates, and the bits of them.
 * BOARD_RELEASES: how many release outputs.
 * BOARD_LATENCY: ticks from an edge to its stamp, which the core subtracts.
 * BOARD_BUSY: a stamp that follows another within so many ticks belongs to an edge that waited for
 *   the end of what stamped the other; 0 where none waits.
 * BOARD_LATE: an event that follows another within so many ticks counts as late (`late_ticks`).
 * BOARD_REACH: for how many ticks hardware can end a pulse of the release by itself. A longer one
 *   is put off on its way.
 * BOARD_SHORT: a pulse of fewer ticks may be too short for that hardware.
 * BOARD_BYTES_WAIT: 1 where bytes on the line wait until they are taken, 0 where they are lost.
 * BOARD_STEPS: how many entries become events, and events go into a frame, in one turn of the main
 *   loop.
 * BOARD_BOOTS: only where the chip has a program of its own that takes firmware.
 * BOARD_FLASH: attribute of tables that stay in flash; BOARD_KEPT: of variables that a reset leaves
 *   as they are.
 * board_type, board_channels: tables of text, what the board and its gate pins are called. */
#if !defined BOARD_HZ || !defined BOARD_CAPACITY || !defined BOARD_STREAMS
#error "board.h must bring BOARD_HZ, BOARD_CAPACITY and BOARD_STREAMS"
#endif
#if !defined BOARD_GATES || !defined BOARD_GATE_MASK || !defined BOARD_RELEASES
#error "board.h must bring BOARD_GATES, BOARD_GATE_MASK and BOARD_RELEASES"
#endif
#if !defined BOARD_LATENCY || !defined BOARD_BUSY || !defined BOARD_LATE
#error "board.h must bring BOARD_LATENCY, BOARD_BUSY and BOARD_LATE"
#endif
#if !defined BOARD_REACH || !defined BOARD_SHORT
#error "board.h must bring BOARD_REACH and BOARD_SHORT"
#endif
#if !defined BOARD_BYTES_WAIT || !defined BOARD_STEPS
#error "board.h must bring BOARD_BYTES_WAIT and BOARD_STEPS"
#endif
#if !defined BOARD_FLASH || !defined BOARD_KEPT
#error "board.h must bring BOARD_FLASH and BOARD_KEPT"
#endif
NEEDS(BOARD_HZ % 1000000 == 0, "a BOARD_HZ of whole ticks in a microsecond");
NEEDS(sizeof board_type - 1 <= 24, "a board_type of at most 24 characters");
NEEDS(sizeof board_channels - 1 <= 96, "board_channels of at most 96 characters");

/* What stands in a table of BOARD_FLASH. */
NEEDS_FUNCTION(board_flash8, uint8_t (*)(const void *), "uint8_t board_flash8(const void *at)");
NEEDS_FUNCTION(board_flash32, uint32_t (*)(const void *), "uint32_t board_flash32(const void *at)");

/* -- time */

/* The counter; and the same without holding interrupts off, up to 16 us ahead now and then. */
NEEDS_FUNCTION(board_count, uint16_t (*)(void), "uint16_t board_count(void)");
NEEDS_FUNCTION(board_count_roughly, uint16_t (*)(void), "uint16_t board_count_roughly(void)");

/* Which half of the counter's range has begun for sure: goes into every entry (ticks.h). A board
 * that knows all 32 bits of a stamp writes its bits 15 to 22 there itself, less one. */
NEEDS_FUNCTION(board_publish_half, void (*)(uint8_t), "void board_publish_half(uint8_t half)");

/* -- gates */

/* All gates as they are now, 1 for blocked. */
NEEDS_FUNCTION(board_gates, uint16_t (*)(void), "uint16_t board_gates(void)");

/* Write an entry whenever one of these gates changes, from now on; 0: no more. What changed before
 * this call is not lost to an order that went before. */
NEEDS_FUNCTION(board_watch, void (*)(uint16_t), "void board_watch(uint16_t gates)");

/* An entry has two ports of eight bits each: which gates they are, and the other way round. */
NEEDS_FUNCTION(board_gates_of, uint16_t (*)(uint8_t, uint8_t),
               "uint16_t board_gates_of(uint8_t port_0, uint8_t port_1)");
NEEDS_FUNCTION(board_ports_of, uint16_t (*)(uint16_t), "uint16_t board_ports_of(uint16_t gates)");

/* -- entries (events.h says what one is) */

/* Begin at `memory`; `stop` is the place that must not be written, until another one is given. */
NEEDS_FUNCTION(board_entries_start, void (*)(uint8_t *, uint8_t *),
               "void board_entries_start(uint8_t *memory, uint8_t *stop)");
NEEDS_FUNCTION(board_entries_stop, void (*)(uint8_t *), "void board_entries_stop(uint8_t *slot)");

/* Where the next entry will be written, and whether there is one at this place already. */
NEEDS_FUNCTION(board_entries_end, uint8_t *(*)(void), "uint8_t *board_entries_end(void)");
NEEDS_FUNCTION(board_has_entry, bool (*)(const uint8_t *),
               "bool board_has_entry(const uint8_t *entry)");

/* Write the next one at `to`, if it would have been at `from` until now; tell whether. */
NEEDS_FUNCTION(board_entries_rewind, bool (*)(const uint8_t *, uint8_t *),
               "bool board_entries_rewind(const uint8_t *from, uint8_t *to)");

/* How many found no memory since the start, at most 65535. */
NEEDS_FUNCTION(board_entries_lost, uint16_t (*)(void), "uint16_t board_entries_lost(void)");

/* Called in each turn: what a lack of memory has switched off goes on. */
NEEDS_FUNCTION(board_resume, void (*)(void), "void board_resume(void)");

/* -- release */

/* The outputs in `release` go on, all at once, and the sync output with them or just before; hardware
 * ends the pulse after `ticks`, at most BOARD_REACH. Returns when they went on. */
NEEDS_FUNCTION(board_fire, uint16_t (*)(uint8_t, uint32_t),
               "uint16_t board_fire(uint8_t release, uint32_t ticks)");

/* Put its end off; only called where a pulse can be longer than BOARD_REACH. */
NEEDS_FUNCTION(board_release_end, void (*)(uint16_t), "void board_release_end(uint16_t count)");

/* All outputs off, now; the sync output stays. */
NEEDS_FUNCTION(board_release_off, void (*)(void), "void board_release_off(void)");

/* Whether one of their pins is high. */
NEEDS_FUNCTION(board_release_high, bool (*)(void), "bool board_release_high(void)");

/* By how many ticks hardware made the latest pulse shorter because the emergency stop was open; 0
 * where hardware does not look at it. */
NEEDS_FUNCTION(board_release_cut, uint32_t (*)(void), "uint32_t board_release_cut(void)");

NEEDS_FUNCTION(board_sync, void (*)(bool), "void board_sync(bool on)");

/* -- other inputs */

/* The emergency stop reads open. */
NEEDS_FUNCTION(board_stopped, bool (*)(void), "bool board_stopped(void)");

/* Whether the 1 Hz reference has risen since the last call, and when. */
NEEDS_FUNCTION(board_reference, bool (*)(uint16_t *), "bool board_reference(uint16_t *count)");

/* From now on: whether the release-sense input has changed, and when. */
NEEDS_FUNCTION(board_sense_begin, void (*)(void), "void board_sense_begin(void)");
NEEDS_FUNCTION(board_sensed, bool (*)(uint16_t *), "bool board_sensed(uint16_t *count)");

/* A new measure of the supply, larger when that is lower; 0: none. And what it is in millivolts. */
NEEDS_FUNCTION(board_supply, uint16_t (*)(void), "uint16_t board_supply(void)");
NEEDS_FUNCTION(board_supply_mv, uint16_t (*)(uint16_t),
               "uint16_t board_supply_mv(uint16_t measured)");

/* -- the line */

/* Take a byte, if there is one. */
NEEDS_FUNCTION(board_receive, bool (*)(uint8_t *), "bool board_receive(uint8_t *byte)");

/* Send as many of these as the line takes now, and tell how many. Where nobody listens it takes all,
 * and they are lost. */
NEEDS_FUNCTION(board_send, uint8_t (*)(const uint8_t *, uint8_t),
               "uint8_t board_send(const uint8_t *bytes, uint8_t count)");

/* -- the rest */

NEEDS_FUNCTION(board_led, void (*)(bool), "void board_led(bool on)");

/* The watchdog restarts the board when this was not called for 120 ms. */
NEEDS_FUNCTION(board_kick, void (*)(void), "void board_kick(void)");

/* The board's own name as a record of name.h, and a new one to keep. A board that has its number
 * from the factory seals that and is never asked to keep another. */
NEEDS_FUNCTION(board_name, void (*)(uint8_t *), "void board_name(uint8_t record[])");
#ifdef BOARD_BOOTS
/* Start that program once the line has taken everything; until then called in each turn. */
NEEDS_FUNCTION(board_boot, void (*)(void), "void board_boot(void)");
#endif
NEEDS_FUNCTION(board_rename, void (*)(const uint8_t *), "void board_rename(const uint8_t record[])");

#endif
