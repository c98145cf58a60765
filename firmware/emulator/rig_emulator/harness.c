/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * What stands between simavr 1.6 and the silicon, and wires for tests. simavr's core, timers,
 * watchdog and EEPROM are used as they are; "defect" marks where it differs from the data sheets
 * (ATmega640/1280/2560: DS40002211A, ATmega328P: DS40002061B) and what is done about it.
 */
#include "inside.h"

#include <stdarg.h>
#include <stdio.h>

#define UNLIMITED 0xFFFFFFFFu    /* cycles between two looks at the cycle timers */
#define SUPPLY_MV 5000u
#define ADDRESSES 0x10000u       /* of a 16-bit pointer */

void schedule(board_t *b, uint64_t cycle, avr_cycle_timer_t timer)
{
    uint64_t now = b->avr->cycle;
    avr_cycle_timer_register(b->avr, cycle > now ? cycle - now : 0, timer, b);
}

/* -- faults: what simavr only prints */

static void listen(avr_t *avr, const int level, const char *format, va_list values)
{
    board_t *b = avr ? avr->custom.data : NULL;
    if (level != LOG_ERROR || !b || b->fault[0])
        return;
    vsnprintf(b->fault, sizeof b->fault, format, values);
    b->fault[strcspn(b->fault, "\n")] = 0;
    b->stop = 1;
    avr->run_cycle_count = 0;
}

static void fail(board_t *b, const char *what)
{
    if (!b->fault[0])
        snprintf(b->fault, sizeof b->fault, "%s (pc 0x%04x)", what, (unsigned)b->avr->pc);
}

static void no_sleep(avr_t *avr, avr_cycle_count_t cycles)
{
    (void)avr;
    (void)cycles; /* defect: simavr would sleep in real time */
}

/* -- reset */

static void mend_after_reset(board_t *b)
{
    avr_t *avr = b->avr;
    avr->run_cycle_limit = UNLIMITED;
    for (uint8_t n = 0; n < 8; n++) /* defect: INTn held low is looked at in every cycle */
        avr_extint_set_strict_lvl_trig(avr, n, 0);
    pins_after_reset(b);
    for (avr_io_t *io = avr->io_port; io; io = io->next) {
        if (strcmp(io->kind, "timer") == 0) { /* defect: TCNT would go on */
            avr_timer_t *t = (avr_timer_t *)io;
            t->tov_cycles = t->cs_div_value = t->tov_top = 0;
        }
    }
    compare_after_reset(b);
    line_after_reset(b);
}

static void restart(board_t *b, void (*how)(avr_t *), avr_regbit_t cause)
{
    uint8_t before = b->avr->data[cause.reg]; /* MCUSR adds up */
    how(b->avr);
    b->avr->data[cause.reg] |= before;
    avr_regbit_set(b->avr, cause);
    mend_after_reset(b);
}

/* Every WDR asks one module after the other whether it is the watchdog: let that be the first. */
static void watchdog_first(avr_t *avr)
{
    for (avr_io_t **io = &avr->io_port; *io; io = &(*io)->next) {
        avr_io_t *watchdog = *io;
        if (strcmp(watchdog->kind, "watchdog") == 0) {
            *io = watchdog->next;
            watchdog->next = avr->io_port;
            avr->io_port = watchdog;
            return;
        }
    }
}

/* Defect: simavr reports an address beyond the memory, and then uses it all the same. */
static void widen_memory(avr_t *avr)
{
    uint32_t flash = avr->flashend + 3; /* with the guard behind its end */
    avr->data = realloc(avr->data, ADDRESSES);
    avr->flash = realloc(avr->flash, flash > ADDRESSES ? flash : ADDRESSES);
    if (!avr->data || !avr->flash)
        abort();
    memset(avr->data + avr->ramend + 1, 0, ADDRESSES - avr->ramend - 1);
    if (flash < ADDRESSES)
        memset(avr->flash + flash, 0xFF, ADDRESSES - flash);
}

/* -- what the header offers */

board_t *board_new(const char *mcu, uint32_t frequency, uint8_t fill)
{
    avr_global_logger_set(listen);
    avr_t *avr = avr_make_mcu_by_name(mcu);
    board_t *b = avr ? calloc(1, sizeof *b) : NULL;
    if (!b)
        return NULL;
    b->avr = avr;
    avr->custom.data = b;
    avr_init(avr);
    widen_memory(avr);
    watchdog_first(avr);
    avr->frequency = frequency;
    avr->vcc = avr->avcc = SUPPLY_MV;
    avr->sleep = no_sleep;
    for (avr_io_t *io = avr->io_port; io; io = io->next) {
        if (strcmp(io->kind, "port") == 0)
            connect_port(b, (avr_ioport_t *)io);
        else if (strcmp(io->kind, "uart") == 0 && ((avr_uart_t *)io)->name == '0')
            connect_uart(b, (avr_uart_t *)io);
    }
    for (avr_io_t *io = avr->io_port; io; io = io->next)
        if (strcmp(io->kind, "timer") == 0)
            connect_compare(b, (avr_timer_t *)io);
    memset(avr->data + avr->ioend + 1, fill, avr->ramend - avr->ioend);
    mend_interrupts(b);
    mend_after_reset(b);
    return b;
}

void board_free(board_t *b)
{
    avr_terminate(b->avr);
    free(b->avr);
    free(b->edges.items);
    free(b->incoming.items);
    free(b->changes.items);
    free(b->sent.items);
    free(b);
}

int board_flash(board_t *b, uint32_t address, const uint8_t *data, uint32_t size)
{
    if (address > b->avr->flashend || size > b->avr->flashend + 1 - address)
        return -1;
    memcpy(b->avr->flash + address, data, size);
    return 0;
}

int board_program(board_t *b, uint32_t address, uint8_t *data, uint32_t size)
{
    if (address > b->avr->flashend || size > b->avr->flashend + 1 - address)
        return -1;
    memcpy(data, b->avr->flash + address, size);
    return 0;
}

void board_start_at(board_t *b, uint32_t address) { b->avr->reset_pc = b->avr->pc = address; }

int board_eeprom_set(board_t *b, uint32_t address, const uint8_t *data, uint32_t size)
{
    if (address > b->avr->e2end || size > b->avr->e2end + 1 - address)
        return -1;
    avr_eeprom_desc_t part = {(uint8_t *)data, (uint16_t)address, size};
    return size ? avr_ioctl(b->avr, AVR_IOCTL_EEPROM_SET, &part) == -2 ? -1 : 0 : 0;
}

int board_eeprom_get(board_t *b, uint32_t address, uint8_t *data, uint32_t size)
{
    if (address > b->avr->e2end || size > b->avr->e2end + 1 - address)
        return -1;
    avr_eeprom_desc_t part = {data, (uint16_t)address, size};
    return avr_ioctl(b->avr, AVR_IOCTL_EEPROM_GET, &part) == -2 ? -1 : 0;
}

int board_poke(board_t *b, uint32_t address, const uint8_t *data, uint32_t size)
{
    if (address > b->avr->ramend || size > b->avr->ramend + 1u - address)
        return -1;
    memcpy(b->avr->data + address, data, size);
    return 0;
}

int board_peek(board_t *b, uint32_t address, uint8_t *data, uint32_t size)
{
    if (address > b->avr->ramend || size > b->avr->ramend + 1u - address)
        return -1;
    memcpy(data, b->avr->data + address, size);
    return 0;
}

uint32_t board_ram_start(const board_t *b) { return b->avr->ioend + 1u; }
uint32_t board_ram_end(const board_t *b) { return b->avr->ramend; }
uint64_t board_cycle(const board_t *b) { return b->avr->cycle; }
const char *board_fault(const board_t *b) { return b->fault; }
uint32_t board_watchdog_resets(const board_t *b) { return b->watchdog_resets; }

uint32_t board_timers(const board_t *b)
{
    uint32_t n = 0;
    for (const avr_cycle_timer_slot_t *t = b->avr->cycle_timers.timer; t; t = t->next)
        n++;
    return n;
}

static avr_cycle_count_t halt(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)avr, (void)when, (void)param; /* only ends the slice at the right instruction */
    return 0;
}

int board_run(board_t *b, uint64_t until, int stop_on_sent)
{
    avr_t *avr = b->avr;
    b->stop_on_sent = stop_on_sent;
    b->stop = 0;
    if (avr->cycle < until)
        schedule(b, until, halt);
    while (avr->cycle < until && !b->stop && !b->fault[0]) {
        if (avr->run != avr_callback_run_raw) { /* the watchdog bites before the next instruction */
            b->watchdog_resets++;
            restart(b, avr->run, avr->reset_flags.wdrf);
            schedule(b, until, halt);
            continue;
        }
        switch (avr_run(avr)) {
        case cpu_Done: fail(b, "it sleeps with interrupts off"); break;
        case cpu_Stopped: case cpu_Crashed: fail(b, "it crashed"); break;
        default: break;
        }
    }
    avr_cycle_timer_cancel(avr, halt, b);
    if (b->fault[0])
        return RUN_FAULT;
    return b->stop;
}

static void reset_by(board_t *b, avr_regbit_t cause)
{
    b->fault[0] = 0;
    b->avr->run = avr_callback_run_raw;
    restart(b, avr_reset, cause);
}

void board_reset(board_t *b) { reset_by(b, b->avr->reset_flags.extrf); }
void board_brown_out(board_t *b) { reset_by(b, b->avr->reset_flags.borf); }

