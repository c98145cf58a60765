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

void send_bytes(const uint8_t *bytes, uint8_t count)
{
    uint16_t crc = out.crc;
    uint8_t size = out.size, code_at = out.code_at; /* a write to the buffer may be one to `out` */
    while (count--) {
        uint8_t byte = *bytes++;
        if (!BOARD_BYTES_WAIT)
            receive_pass();
        crc = crc16_add(crc, byte);
        if (byte == 0) {
            out.buffer[code_at] = (uint8_t)(size - code_at);
            code_at = size;
        }
        out.buffer[size++] = byte; /* a zero's place is taken by the next block's code */
    }
    out.crc = crc;
    out.size = size;
    out.code_at = code_at;
}

void send8(uint8_t value)
{
    send_bytes(&value, 1);
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
    send16(out.crc);
    out.buffer[out.code_at] = (uint8_t)(out.size - out.code_at);
    out.buffer[out.size++] = 0;
    out.ended = true;
}

void send_pass(void)
{
    /* The block being written waits for its code; all before it may leave already. */
    uint8_t final = out.ended ? out.size : out.code_at;
    if (out.sent == final)
        return;
    out.sent = (uint8_t)(out.sent + board_send(out.buffer + out.sent, (uint8_t)(final - out.sent)));
    if (out.ended && out.sent == final)
        send_reset();
}
