/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The compare units' outputs, of 16-bit timers in normal mode. Defect: simavr has no register OCnx
 * that takes a pin over from PORTx, no FOCnx, and sets the pin at an overflow.
 */
#include "inside.h"

enum { DISCONNECTED, TOGGLE, CLEAR, SET };

static uint8_t mode(const wave_t *w)
{
    return avr_regbit_get(w->board->avr, w->timer->comp[w->unit].com);
}

static void put_out(wave_t *w)
{
    uint8_t mask = (uint8_t)(1u << w->pin);
    port_t *p = w->port;
    p->taken = (uint8_t)(mode(w) != DISCONNECTED ? p->taken | mask : p->taken & ~mask);
    p->wave = (uint8_t)(w->latch ? p->wave | mask : p->wave & ~mask);
    outputs(p, p->ddr, p->port);
}

static void match(wave_t *w)
{
    switch (mode(w)) {
    case TOGGLE: w->latch = !w->latch; break;
    case CLEAR: w->latch = 0; break;
    case SET: w->latch = 1; break;
    default: return;
    }
    put_out(w);
}

static avr_cycle_count_t matched(avr_t *avr, avr_cycle_count_t when, void *param)
{
    wave_t *w = param;
    avr_cycle_count_t now = avr->cycle;
    avr->cycle = when; /* and not the end of the instruction that runs */
    match(w);
    avr->cycle = now;
    return when + w->timer->tov_cycles;
}

static void expect(wave_t *w)
{
    avr_t *avr = w->board->avr;
    avr_timer_t *t = w->timer;
    uint8_t *data = avr->data;
    avr_cycle_timer_cancel(avr, matched, w);
    if (!t->tov_cycles)
        return; /* it stands still */
    uint64_t tick = t->tov_cycles / (t->tov_top + 1u);
    uint16_t ocr = (uint16_t)(data[t->comp[w->unit].r_ocr] | data[t->comp[w->unit].r_ocrh] << 8);
    uint64_t behind = avr->cycle - t->tov_base; /* since the counter was 0 */
    uint64_t due = (ocr + 1u) * tick;           /* the output changes a clock after they are equal */
    while (due <= behind)
        due += t->tov_cycles;
    avr_cycle_timer_register(avr, due - behind, matched, w);
}

static void wrote(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param)
{
    hook_t *h = param;
    board_t *b = h->board;
    if (h->write)
        h->write(avr, address, value, h->param);
    else
        avr->data[address] = value;
    for (uint32_t n = 0; n < b->wave_count; n++) {
        wave_t *w = &b->waves[n];
        if (w->timer != h->timer)
            continue;
        if (address == w->timer->comp[w->unit].com.reg + 2u) {
            if (value & 0x80 >> w->unit)
                match(w);
        } else {
            expect(w);
            put_out(w);
        }
    }
    if (address == h->timer->comp[0].com.reg + 2u)
        avr->data[address] = 0; /* FOCnx always reads as zero */
}

static void hook(board_t *b, avr_timer_t *t, avr_io_addr_t address)
{
    hook_t *h = &b->hooks[b->hook_count++];
    avr_t *avr = b->avr;
    avr_io_addr_t io = AVR_DATA_TO_IO(address);
    *h = (hook_t){b, t, avr->io[io].w.c, avr->io[io].w.param};
    avr->io[io].w.c = wrote;
    avr->io[io].w.param = h;
}

/* Defect: PINx of an output would be PORTx. */
static uint8_t read_pin(avr_t *avr, avr_io_addr_t address, void *param)
{
    port_t *p = param;
    uint8_t taken = p->taken & p->ddr;
    uint8_t value = p->read(avr, address, p->io);
    avr->data[address] = (uint8_t)((value & ~taken) | (p->wave & taken));
    return avr->data[address];
}

void connect_compare(board_t *b, avr_timer_t *t)
{
    if (!t->r_tcnth || t->comp[0].com.reg == 0)
        return;
    for (uint8_t unit = 0; unit < AVR_TIMER_COMP_COUNT; unit++) {
        avr_regbit_t pin = t->comp[unit].com_pin;
        for (int n = 0; pin.reg && n < PORTS; n++) {
            port_t *p = &b->ports[n];
            if (!p->io || p->io->r_port != pin.reg)
                continue;
            b->waves[b->wave_count++] = (wave_t){b, t, p, unit, pin.bit, 0};
            hook(b, t, t->comp[unit].r_ocr);
            avr_io_addr_t r_pin = AVR_DATA_TO_IO(p->io->r_pin);
            if (!p->read) {
                p->read = b->avr->io[r_pin].r.c;
                b->avr->io[r_pin].r.c = read_pin;
                b->avr->io[r_pin].r.param = p;
            }
        }
    }
    for (uint8_t n = 0; n < 3; n++) /* TCCRnA, TCCRnB, TCCRnC */
        hook(b, t, t->comp[0].com.reg + n);
    hook(b, t, t->r_tcnt);
}

void compare_after_reset(board_t *b)
{
    for (uint32_t n = 0; n < b->wave_count; n++) {
        b->waves[n].latch = 0;
        avr_cycle_timer_cancel(b->avr, matched, &b->waves[n]);
        put_out(&b->waves[n]);
    }
}
