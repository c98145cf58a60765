/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * UART 0. Both directions are ours; simavr keeps the registers and the receive buffer.
 */
#include "inside.h"

#define BITS_PER_BYTE 10         /* 8N1 */
#define RECEIVE_DEPTH 3          /* two buffered, one in the shift register */

DEFINE_FIFO(uint16_t, uart_fifo);

static uint32_t byte_cycles(const board_t *b)
{
    avr_t *avr = b->avr;
    uint32_t ubrr = avr_regbit_get(avr, b->uart->ubrrl) | avr_regbit_get(avr, b->uart->ubrrh) << 8;
    return (ubrr + 1) * (avr_regbit_get(avr, b->uart->u2x) ? 8 : 16) * BITS_PER_BYTE;
}

static uint8_t heard(const board_t *b, uint8_t value)
{
    uint32_t board = byte_cycles(b), host = b->host_byte;
    uint32_t apart = board > host ? board - host : host - board;
    return apart * 50 > host ? value ^ 0x55 : value; /* sampled in the wrong bits */
}

static void received(board_t *b, uint8_t value)
{
    avr_uart_t *u = b->uart;
    if (!avr_regbit_get(b->avr, u->rxen))
        return;
    if (b->lost) { /* defect: simavr's buffer of 64 hides what silicon loses */
        b->overruns++;
        avr_regbit_set(b->avr, u->dor);
        return;
    }
    uart_fifo_write(&u->input, heard(b, value));
    u->rx_cnt = 0; /* our bytes come at line rate: no need to hold the reader back */
    u->rxc_raise_time = 0;
    avr_raise_interrupt(b->avr, &u->rxc);
}

static avr_cycle_count_t line_due(avr_t *avr, avr_cycle_count_t when, void *param)
{
    board_t *b = param;
    (void)avr;
    const incoming_t *in = queue_at(&b->incoming, b->incoming.first, sizeof *in);
    if (b->receiving) {
        received(b, in->value);
        b->receiving = 0;
        if (++b->incoming.first == b->incoming.end)
            return 0;
        in++;
    }
    if (in->start > when)
        return in->start;
    b->receiving = 1; /* a start bit: is there room? */
    b->lost = uart_fifo_get_read_size(&b->uart->input) >= RECEIVE_DEPTH;
    return when + b->host_byte;
}

static avr_cycle_count_t buffer_empty(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)when;
    avr_raise_interrupt(avr, &((board_t *)param)->uart->udrc);
    return 0;
}

static avr_cycle_count_t all_sent(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)when;
    avr_raise_interrupt(avr, &((board_t *)param)->uart->txc);
    return 0;
}

/* Defects: simavr's byte lasts 11 bits, and it has no buffer before the shift register. */
static void wrote_udr(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param)
{
    board_t *b = param;
    uint64_t now = avr->cycle;
    (void)address;
    if (!avr_regbit_get(avr, b->uart->txen) || b->buffer_free > now)
        return; /* as on silicon, a byte written into a full buffer is gone */
    uint64_t start = b->shift_free > now ? b->shift_free : now;
    b->buffer_free = start;
    b->shift_free = start + byte_cycles(b);
    if (start > now) {
        avr_clear_interrupt(avr, &b->uart->udrc);
        avr_regbit_clear(avr, b->uart->udrc.raised);
        schedule(b, start, buffer_empty);
    }
    schedule(b, b->shift_free, all_sent);
    sent_t s = {b->shift_free, heard(b, value)};
    queue_insert(&b->sent, b->sent.end, &s, sizeof s);
    if (b->stop_on_sent && !b->stop) {
        b->stop = RUN_SENT;
        avr->run_cycle_count = 0;
    }
}

void connect_uart(board_t *b, avr_uart_t *uart)
{
    uint32_t flags = 0; /* defect: the UART sleeps when polled, and echoes to the terminal */
    b->uart = uart;
    avr_ioctl(b->avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    b->avr->io[AVR_DATA_TO_IO(uart->r_udr)].w.c = wrote_udr;
    b->avr->io[AVR_DATA_TO_IO(uart->r_udr)].w.param = b;
    b->host_byte = byte_cycles(b);
}

void line_after_reset(board_t *b)
{
    while (b->sent.first < b->sent.end &&
           ((sent_t *)queue_at(&b->sent, b->sent.end - 1, sizeof(sent_t)))->cycle > b->avr->cycle)
        b->sent.end--; /* cut short */
    b->buffer_free = b->shift_free = 0;
    if (b->incoming.first < b->incoming.end) {
        incoming_t *in = queue_at(&b->incoming, b->incoming.first, sizeof *in);
        schedule(b, in->start + (b->receiving ? b->host_byte : 0), line_due);
    }
}

uint32_t board_take_sent(board_t *b, sent_t *to, uint32_t room)
{
    return queue_take(&b->sent, to, room, sizeof *to);
}

void board_line(board_t *b, uint32_t host_byte) { b->host_byte = host_byte; }

void board_receive(board_t *b, uint64_t cycle, const uint8_t *data, uint32_t size)
{
    int idle = b->incoming.first == b->incoming.end;
    if (b->line_free < cycle)
        b->line_free = cycle;
    if (b->line_free < b->avr->cycle)
        b->line_free = b->avr->cycle;
    for (uint32_t i = 0; i < size; i++) {
        incoming_t in = {b->line_free, data[i]};
        queue_insert(&b->incoming, b->incoming.end, &in, sizeof in);
        b->line_free += b->host_byte;
    }
    if (idle && size)
        schedule(b, ((incoming_t *)queue_at(&b->incoming, b->incoming.first,
                                            sizeof(incoming_t)))->start, line_due);
}

uint32_t board_overruns(const board_t *b) { return b->overruns; }
