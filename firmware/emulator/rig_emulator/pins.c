/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Edges from outside at their cycles, and what the outputs do.
 */
#include "inside.h"

static uint8_t driven_high(const port_t *p)
{
    return p->ddr & ((p->port & ~p->taken) | (p->wave & p->taken));
}

void outputs(port_t *p, uint8_t ddr, uint8_t port)
{
    board_t *b = p->board;
    uint8_t is, was = p->is;
    p->ddr = ddr;
    p->port = port;
    p->is = is = driven_high(p);
    for (uint8_t pin = 0; pin < 8; pin++) {
        if (!((is ^ was) >> pin & 1))
            continue;
        change_t c = {b->avr->cycle, (char)('A' + (p - b->ports)), pin, is >> pin & 1};
        queue_insert(&b->changes, b->changes.end, &c, sizeof c);
    }
    if ((is ^ was) & p->watched) {
        b->stop = RUN_PIN;
        b->avr->run_cycle_count = 0; /* no further instruction */
    }
}

static void wrote_port(struct avr_irq_t *irq, uint32_t value, void *param)
{
    port_t *p = param;
    (void)irq;
    outputs(p, p->ddr, (uint8_t)value);
}

static void wrote_ddr(struct avr_irq_t *irq, uint32_t value, void *param)
{
    port_t *p = param;
    (void)irq;
    outputs(p, (uint8_t)value, p->port);
}

static void drive(board_t *b, const edge_t *e)
{
    port_t *p = &b->ports[e->port];
    uint8_t mask = (uint8_t)(1u << e->pin);
    p->driven |= mask;
    p->level = (uint8_t)(e->level ? p->level | mask : p->level & ~mask);
    /* Defect: any write to PORTx would raise the pins that have a pull-up. */
    avr_ioport_external_t wires = {(unsigned)('A' + e->port) & 0x7F, p->driven, p->level};
    avr_ioctl(b->avr, AVR_IOCTL_IOPORT_SET_EXTERNAL('A' + e->port), &wires);
    avr_raise_irq(p->io->io.irq + e->pin, e->level);
}

static avr_cycle_count_t edges_due(avr_t *avr, avr_cycle_count_t when, void *param)
{
    board_t *b = param;
    avr_cycle_count_t now = avr->cycle;
    for (; b->edges.first < b->edges.end; b->edges.first++) {
        const edge_t *e = queue_at(&b->edges, b->edges.first, sizeof *e);
        if (e->cycle > when)
            return e->cycle;
        /* Defect: capture would take the time at the end of the instruction that runs. */
        avr->cycle = when;
        drive(b, e);
        avr->cycle = now;
    }
    return 0;
}

static void schedule_edges(board_t *b)
{
    avr_cycle_timer_cancel(b->avr, edges_due, b);
    if (b->edges.first < b->edges.end)
        schedule(b, ((edge_t *)queue_at(&b->edges, b->edges.first, sizeof(edge_t)))->cycle,
                 edges_due);
}

static port_t *port_of(const board_t *b, char name, int pin)
{
    if (name < 'A' || name >= 'A' + PORTS || pin < 0 || pin > 7 || !b->ports[name - 'A'].io)
        return NULL;
    return (port_t *)&b->ports[name - 'A'];
}

void connect_port(board_t *b, avr_ioport_t *io)
{
    port_t *p = &b->ports[io->name - 'A'];
    p->board = b;
    p->io = io;
    avr_irq_register_notify(io->io.irq + IOPORT_IRQ_REG_PORT, wrote_port, p);
    avr_irq_register_notify(io->io.irq + IOPORT_IRQ_DIRECTION_ALL, wrote_ddr, p);
}

void pins_after_reset(board_t *b)
{
    for (int n = 0; n < PORTS; n++) {
        port_t *p = &b->ports[n];
        if (!p->io)
            continue;
        outputs(p, 0, 0);
        /* Defect: PINx is forgotten, and levels that come again are filtered as nothing new. */
        b->avr->data[p->io->r_pin] = p->level & p->driven;
        for (int i = 0; i < IOPORT_IRQ_COUNT; i++)
            if (i >= 8 || !(p->driven >> i & 1))
                p->io->io.irq[i].value = 0;
    }
    schedule_edges(b);
}

int board_edge(board_t *b, uint64_t cycle, char port, int pin, int level)
{
    if (!port_of(b, port, pin))
        return -1;
    edge_t e = {cycle, (uint8_t)(port - 'A'), (uint8_t)pin, level != 0};
    uint32_t at = b->edges.end;
    while (at > b->edges.first &&
           ((edge_t *)queue_at(&b->edges, at - 1, sizeof e))->cycle > cycle)
        at--;
    queue_insert(&b->edges, at, &e, sizeof e);
    schedule_edges(b);
    return 0;
}

int board_clear_edges(board_t *b, char port, int pin)
{
    uint32_t kept = b->edges.first;
    if (!port_of(b, port, pin))
        return -1;
    for (uint32_t i = b->edges.first; i < b->edges.end; i++) {
        edge_t e = *(edge_t *)queue_at(&b->edges, i, sizeof e);
        if (e.port != port - 'A' || e.pin != pin)
            memcpy(queue_at(&b->edges, kept++, sizeof e), &e, sizeof e);
    }
    b->edges.end = kept;
    schedule_edges(b);
    return 0;
}

uint32_t board_edges_left(const board_t *b) { return b->edges.end - b->edges.first; }

int board_watch(board_t *b, char port, int pin, int on)
{
    port_t *p = port_of(b, port, pin);
    if (!p)
        return -1;
    p->watched = (uint8_t)(on ? p->watched | 1u << pin : p->watched & ~(1u << pin));
    return 0;
}

int board_output(const board_t *b, char port, int pin)
{
    const port_t *p = port_of(b, port, pin);
    return p ? p->is >> pin & 1 : -1;
}

uint32_t board_take_changes(board_t *b, change_t *to, uint32_t room)
{
    return queue_take(&b->changes, to, room, sizeof *to);
}
