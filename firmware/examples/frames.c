#include "frames.h"

#include <string.h>

#define HEAD 3 /* type, seq, ack */
#define CRC 2

uint16_t crc16(const uint8_t *bytes, size_t count)
{
    uint16_t crc = 0xFFFF;
    while (count--) {
        crc ^= (uint16_t)(*bytes++ << 8);
        for (int bit = 0; bit < 8; bit++)
            crc = (uint16_t)(crc & 0x8000 ? crc << 1 ^ 0x1021 : crc << 1);
    }
    return crc;
}

uint32_t crc32(const uint8_t *bytes, size_t count)
{
    uint32_t crc = 0xFFFFFFFF;
    while (count--) {
        crc ^= *bytes++;
        for (int bit = 0; bit < 8; bit++)
            crc = crc & 1 ? crc >> 1 ^ 0xEDB88320 : crc >> 1;
    }
    return ~crc;
}

size_t frame_write(const struct frame *frame, uint8_t *line)
{
    uint8_t body[HEAD + PAYLOAD_LIMIT + CRC] = {frame->type, frame->seq, frame->ack};
    size_t count = HEAD + (size_t)frame->size, out = 1, length_at = 0;
    memcpy(body + HEAD, frame->payload, frame->size);
    uint16_t crc = crc16(body, count);
    body[count++] = (uint8_t)crc;
    body[count++] = (uint8_t)(crc >> 8);
    for (size_t n = 0; n < count; n++) {
        if (body[n]) {
            line[out++] = body[n];
        } else {
            line[length_at] = (uint8_t)(out - length_at);
            length_at = out++;
        }
    }
    line[length_at] = (uint8_t)(out - length_at);
    line[out++] = 0;
    return out;
}

/* Puts the zeros in again; the number of bytes, or 0 when that is no COBS. */
static size_t unstuff(const uint8_t *in, size_t count, uint8_t *out)
{
    size_t at = 0, made = 0;
    while (at < count) {
        size_t end = at + in[at];
        if (end > count)
            return 0;
        for (at++; at < end; at++)
            out[made++] = in[at];
        if (at < count)
            out[made++] = 0;
    }
    return made;
}

bool frame_read(struct reader *reader, uint8_t byte, struct frame *frame)
{
    uint8_t body[FRAME_LIMIT];
    size_t count;
    if (byte) {
        if (reader->count == FRAME_LIMIT)
            reader->too_long = true;
        else
            reader->bytes[reader->count++] = byte;
        return false;
    }
    count = reader->too_long ? 0 : unstuff(reader->bytes, reader->count, body);
    reader->count = 0;
    reader->too_long = false;
    if (count < HEAD + CRC || count > HEAD + PAYLOAD_LIMIT + CRC ||
        crc16(body, count - CRC) != get16(body + count - CRC))
        return false;
    frame->type = body[0];
    frame->seq = body[1];
    frame->ack = body[2];
    frame->size = (uint8_t)(count - HEAD - CRC);
    memcpy(frame->payload, body + HEAD, frame->size);
    return true;
}

void put8(struct frame *frame, uint8_t value)
{
    frame->payload[frame->size++] = value;
}

void put16(struct frame *frame, uint16_t value)
{
    put8(frame, (uint8_t)value);
    put8(frame, (uint8_t)(value >> 8));
}

void put32(struct frame *frame, uint32_t value)
{
    put16(frame, (uint16_t)value);
    put16(frame, (uint16_t)(value >> 16));
}

uint16_t get16(const uint8_t *at)
{
    return (uint16_t)(at[0] | at[1] << 8);
}

uint32_t get32(const uint8_t *at)
{
    return get16(at) | (uint32_t)get16(at + 2) << 16;
}
