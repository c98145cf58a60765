#include "ticks.h"

#include "board.h"

#define HALF_BITS 15
#define EARLY (1u << 13) /* how much too early a half may be counted */

static uint32_t halves; /* of the counter's range, since the device started */

static uint32_t extended(uint32_t half, uint16_t count)
{
    uint32_t base = (half << HALF_BITS) - EARLY;
    return base + (uint16_t)(count - (uint16_t)base);
}

void ticks_start(uint32_t time)
{
    halves = (time >> 16 << 1) + (board_count() >> HALF_BITS);
    board_publish_half((uint8_t)halves);
}

uint32_t ticks_pass(void)
{
    uint32_t now = extended(halves, board_count_roughly());
    if ((int32_t)(now - ((halves + 1) << HALF_BITS)) >= 0) {
        halves++;
        board_publish_half((uint8_t)halves);
    }
    return now;
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
