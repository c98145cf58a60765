#include "ticks.h"

#include "board_api.h"

#define HALF_BITS 15
#define BEHIND 0x400 /* by how much a rough look may have been ahead, with room to spare */
#define SELDOM 0x1000 /* looks closer together change nothing */

static uint32_t looked; /* the time when the counter was last looked at */
static uint32_t halves; /* of the counter's range, begun for sure by then */

static uint32_t extended(uint16_t count)
{
    uint16_t ahead = (uint16_t)(count - (uint16_t)looked);
    return looked + ahead - (ahead >= (uint16_t)-BEHIND ? 0x10000u : 0);
}

static void publish(void)
{
    halves = (looked - BEHIND) >> HALF_BITS;
    board_publish_half((uint8_t)halves);
}

void ticks_start(uint32_t time)
{
    looked = (time & 0xFFFF0000u) + board_count();
    publish();
}

void ticks_pass(void)
{
    uint16_t ahead = (uint16_t)(board_count_roughly() - (uint16_t)looked);
    if (ahead >= SELDOM && ahead < (uint16_t)-BEHIND) {
        looked += ahead;
        publish();
    }
}

uint32_t ticks_roughly(void)
{
    return extended(board_count_roughly());
}

uint32_t ticks_now(void)
{
    return extended(board_count());
}

uint32_t ticks_of(uint16_t count)
{
    uint32_t now = ticks_now();
    return now - (uint16_t)((uint16_t)now - count);
}

uint32_t ticks_stamped(uint16_t count, uint8_t half)
{
    uint32_t begun = (halves - (uint8_t)((uint8_t)halves - half)) << HALF_BITS;
    return begun + (uint16_t)(count - (uint16_t)begun);
}
