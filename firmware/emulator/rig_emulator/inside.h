/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * What the harness's files share. Its functions are explained where they are defined.
 */
#ifndef INSIDE_H
#define INSIDE_H
#include "harness.h"

#include <stdlib.h>
#include <string.h>

#include <avr_eeprom.h>
#include <avr_extint.h>
#include <avr_ioport.h>
#include <avr_timer.h>
#include <avr_uart.h>
#include <sim_avr.h>

#define PORTS 12                 /* A ... L */

typedef struct {
    uint64_t cycle;
    uint8_t port, pin, level;
} edge_t;

typedef struct {
    uint64_t start;
    uint8_t value;
} incoming_t;

typedef struct {
    char *items;
    uint32_t first, end, room; /* what is in it: first ... end - 1 */
} queue_t;

typedef struct {
    board_t *board;
    avr_int_vector_t *vector;
} entry_t;

typedef struct {
    board_t *board;
    avr_ioport_t *io;
    uint8_t driven, level;     /* from outside */
    uint8_t ddr, port, is, watched;
    uint8_t taken, wave;       /* pins that compare units drive, and how */
    avr_io_read_t read;        /* simavr's own reading of PINx */
} port_t;

typedef struct {
    board_t *board;
    avr_timer_t *timer;
    port_t *port;
    uint8_t unit, pin, latch;
} wave_t;

typedef struct {
    board_t *board;
    avr_timer_t *timer;
    avr_io_write_t write;      /* simavr's own, behind ours */
    void *param;
} hook_t;

struct board {
    avr_t *avr;
    avr_uart_t *uart;
    port_t ports[PORTS];
    entry_t entries[64];
    wave_t waves[12];          /* four timers with three units each */
    hook_t hooks[28];
    uint32_t wave_count, hook_count;
    queue_t edges, incoming, changes, sent;
    uint32_t entry_cycles, host_byte;
    uint32_t overruns, watchdog_resets;
    uint64_t line_free;        /* host to board */
    uint64_t buffer_free, shift_free; /* board to host */
    int receiving, lost;
    int stop_on_sent, stop;
    char fault[160];
};

void *queue_at(const queue_t *q, uint32_t i, size_t size);
void queue_insert(queue_t *q, uint32_t at, const void *item, size_t size);
uint32_t queue_take(queue_t *q, void *to, uint32_t room, size_t size);

void schedule(board_t *b, uint64_t cycle, avr_cycle_timer_t timer);

void mend_interrupts(board_t *b);

void connect_port(board_t *b, avr_ioport_t *io);
void pins_after_reset(board_t *b);
void outputs(port_t *p, uint8_t ddr, uint8_t port);

void connect_compare(board_t *b, avr_timer_t *timer);
void compare_after_reset(board_t *b);

void connect_uart(board_t *b, avr_uart_t *uart);
void line_after_reset(board_t *b);

#endif
