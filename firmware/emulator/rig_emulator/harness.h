/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * An AVR with wires on its pins and its UART, in exact cycles. Python reads this same header
 * (lines with a '#' are left out then).
 */
#ifndef HARNESS_H
#define HARNESS_H
#include <stdint.h>

typedef struct board board_t;

typedef struct {
    uint64_t cycle;   /* when the instruction that did it began */
    char port;        /* 'A' ... 'L' */
    uint8_t pin;
    uint8_t high;     /* driven high; an output that is low and an input are both 0 */
} change_t;

typedef struct {
    uint64_t cycle;   /* when the stop bit is over */
    uint8_t value;
} sent_t;

/* Why board_run came back. */
enum { RUN_DONE = 0, RUN_PIN = 1, RUN_SENT = 2, RUN_FAULT = -1 };

/* NULL when there is no such controller. RAM starts as `fill` everywhere. */
board_t *board_new(const char *mcu, uint32_t frequency, uint8_t fill);
void board_free(board_t *b);
/* 0, or -1 when it does not fit. */
int board_flash(board_t *b, uint32_t address, const uint8_t *data, uint32_t size);
int board_program(board_t *b, uint32_t address, uint8_t *data, uint32_t size); /* read flash */
int board_eeprom_set(board_t *b, uint32_t address, const uint8_t *data, uint32_t size);
int board_eeprom_get(board_t *b, uint32_t address, uint8_t *data, uint32_t size);
int board_poke(board_t *b, uint32_t address, const uint8_t *data, uint32_t size);
int board_peek(board_t *b, uint32_t address, uint8_t *data, uint32_t size);
/* Where a reset begins: a boot loader's address. The board begins there now, too. */
void board_start_at(board_t *b, uint32_t address);
uint32_t board_ram_start(const board_t *b);
uint32_t board_ram_end(const board_t *b); /* the last byte */

uint64_t board_cycle(const board_t *b);
/* Runs to the first instruction that begins at `until` or later; earlier when a watched pin
 * changes and, if `stop_on_sent`, when a byte begins to be sent. */
int board_run(board_t *b, uint64_t until, int stop_on_sent);
const char *board_fault(const board_t *b);
void board_reset(board_t *b); /* the reset pin; also leaves a fault behind */
void board_brown_out(board_t *b);
uint32_t board_watchdog_resets(const board_t *b);
uint32_t board_timers(const board_t *b); /* what simavr waits for: each one slows it */

/* The level outside a pin from a cycle on; one that is over means now. 0, or -1: no such pin. */
int board_edge(board_t *b, uint64_t cycle, char port, int pin, int level);
int board_clear_edges(board_t *b, char port, int pin); /* those still to come */
uint32_t board_edges_left(const board_t *b);
int board_watch(board_t *b, char port, int pin, int on);
int board_output(const board_t *b, char port, int pin); /* driven high now */
/* Take what happened since the last time: at most `room` of it, the number is returned. */
uint32_t board_take_changes(board_t *b, change_t *to, uint32_t room);
uint32_t board_take_sent(board_t *b, sent_t *to, uint32_t room);

/* Cycles a byte of the host takes; the board must be within 2 % of it to be understood. */
void board_line(board_t *b, uint32_t byte_cycles);
/* The host sends: the first start bit at `cycle` or when the line is free. */
void board_receive(board_t *b, uint64_t cycle, const uint8_t *data, uint32_t size);
uint32_t board_overruns(const board_t *b);
#endif
