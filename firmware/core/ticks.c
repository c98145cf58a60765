#include "ticks.h"

#include "board.h"

#define HALF_BITS 15

static uint32_t halves; /* of the counter's range, since the device started */

static uint32_t extended(uint32_t half, uint16_t count)
{
    uint32_t base = half << HALF_BITS;
    return base + (uint16_t)(count - (uint16_t)base);
}

void ticks_start(uint32_t time)
{
    halves = (time >> 16 << 1) + (board_count() >> HALF_BITS);
    board_publish_half((uint8_t)halves);
}

void ticks_pass(void)
{
    /* A half counts as begun when half of it is over: a rough count, which may be a little ahead,
     * then never counts one twice. */
    uint8_t quarter = (uint8_t)(board_count_roughly() >> (HALF_BITS - 1));
    if (quarter == ((halves & 1) ? 1 : 3)) {
        halves++;
        board_publish_half((uint8_t)halves);
    }
}

uint32_t ticks_roughly(void)
{
    return extended(halves, board_count_roughly());
}

uint32_t ticks_now(void)
{
    return extended(halves, board_count());
}

uint32_t ticks_of(uint16_t count)
{
    uint32_t now = ticks_now();
    return now - (uint16_t)((uint16_t)now - count);
}

uint32_t ticks_stamped(uint16_t count, uint8_t half)
{
    return extended(halves - (uint8_t)((uint8_t)halves - half), count);
}
