/* The two checks of the wire. */
#ifndef CHECKS_H
#define CHECKS_H

#include <stdint.h>

#define CRC16_START 0xFFFFu
#define CRC32_START 0xFFFFFFFFu

/* CRC-16/CCITT-FALSE: polynomial 0x1021, not reflected. */
static inline uint16_t crc16_add(uint16_t crc, uint8_t byte)
{
    uint8_t x = (uint8_t)((uint8_t)(crc >> 8) ^ byte);
    x = (uint8_t)(x ^ x >> 4);
    return (uint16_t)((uint16_t)(crc << 8) ^ (uint16_t)((uint16_t)x << 12) ^
                      (uint16_t)((uint16_t)x << 5) ^ x);
}

/* The usual CRC-32 (that of zip); start with CRC32_START and invert at the end. */
uint32_t crc32_add(uint32_t crc, uint8_t byte);

#endif
