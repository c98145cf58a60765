/* Frames as PROTOCOL.md describes them: bytes in and out, and nothing else. */
#ifndef FRAMES_H
#define FRAMES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define PAYLOAD_LIMIT 248
#define FRAME_LIMIT 256 /* on the line, with the zero at its end */

struct frame {
    uint8_t type, seq, ack, size;
    uint8_t payload[PAYLOAD_LIMIT];
};

/* What has come since the last zero. */
struct reader {
    uint8_t bytes[FRAME_LIMIT];
    size_t count;
    bool too_long;
};

uint16_t crc16(const uint8_t *bytes, size_t count);
uint32_t crc32(const uint8_t *bytes, size_t count);

/* Writes a frame to `line`, which has FRAME_LIMIT bytes; says how many it took. */
size_t frame_write(const struct frame *frame, uint8_t *line);

/* Takes one byte; true when a good frame has ended with it. */
bool frame_read(struct reader *reader, uint8_t byte, struct frame *frame);

/* Numbers, little-endian; `put` ones move the frame's end. */
void put8(struct frame *frame, uint8_t value);
void put16(struct frame *frame, uint16_t value);
void put32(struct frame *frame, uint32_t value);
uint16_t get16(const uint8_t *at);
uint32_t get32(const uint8_t *at);
#endif
