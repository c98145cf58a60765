#include "send.h"

#include "board_api.h"
#include "checks.h"
#include "receive.h"

static struct {
    uint8_t buffer[SEND_ROOM];
    uint8_t size; /* 0: no frame begun */
    uint8_t sent;
    uint8_t code_at; /* where the COBS code of the open block belongs */
    uint8_t seq;
    bool ended;
    uint16_t crc;
} out;

void send_reset(void)
{
    out.size = out.sent = out.code_at = 0;
    out.ended = false;
}

bool send_idle(void)
{
    return out.size == 0;
}

static void stuff(uint8_t byte)
{
    if (byte == 0) {
        out.buffer[out.code_at] = (uint8_t)(out.size - out.code_at);
        out.code_at = out.size;
    }
    out.buffer[out.size++] = byte; /* a zero's place is taken by the next block's code */
}

void send8(uint8_t value)
{
    receive_pass();
    out.crc = crc16_add(out.crc, value);
    stuff(value);
}

void send16(uint16_t value)
{
    send8((uint8_t)value);
    send8((uint8_t)(value >> 8));
}

void send32(uint32_t value)
{
    send16((uint16_t)value);
    send16((uint16_t)(value >> 16));
}

void send_begin(uint8_t type, uint8_t ack)
{
    out.crc = CRC16_START;
    out.code_at = 0;
    out.size = 1;
    out.sent = 0;
    out.ended = false;
    if (++out.seq == 0)
        out.seq = 1;
    send8(type);
    send8(out.seq);
    send8(ack);
}

void send_end(void)
{
    uint16_t crc = out.crc;
    stuff((uint8_t)crc);
    stuff((uint8_t)(crc >> 8));
    out.buffer[out.code_at] = (uint8_t)(out.size - out.code_at);
    out.buffer[out.size++] = 0;
    out.ended = true;
}

void send_pass(void)
{
    /* The block being written waits for its code; all before it may leave already. */
    uint8_t final = out.ended ? out.size : out.code_at;
    if (out.sent == final || !board_send_ready())
        return;
    board_send(out.buffer[out.sent++]);
    if (out.ended && out.sent == out.size)
        send_reset();
}
