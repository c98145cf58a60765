#include "release.h"

#include "board_api.h"
#include "ticks.h"
#include "wire.h"

/* The end is put off when this much of it is over. */
#define SOON 0x1000
/* A pulse is on this long after its end: hardware failed to end it. */
#define FAILED 0x400

static struct {
    uint32_t since, length; /* of the pulse, or of the rest after it, in ticks */
    uint32_t end;           /* when hardware ends the pulse, as it is set now */
    bool on, resting, sync;
    uint32_t lasted;
    uint8_t ended_by;
} pulse;

static void ended(uint32_t at, uint8_t by)
{
    board_release_off();
    pulse.on = false;
    pulse.resting = true;
    pulse.lasted = at - pulse.since;
    pulse.ended_by = by;
    pulse.length = pulse.lasted * RELEASE_REST;
    pulse.since = at;
}

static void end_now(uint8_t by)
{
    board_release_off();
    ended(ticks_now(), by);
}

static uint32_t within_reach(uint32_t left)
{
    return left < BOARD_REACH ? left : BOARD_REACH;
}

/* Hardware is told its end when the pulse begins, and put off for as long as this is called: a main
 * loop that stands still ends the pulse too early, never too late. */
static void put_off(uint32_t now)
{
    pulse.end = now + within_reach(pulse.since + pulse.length - now);
    board_release_end((uint16_t)pulse.end);
}

void release_reset(void)
{
    pulse.on = pulse.resting = pulse.sync = false;
    board_release_off();
    board_sync(false);
}

uint32_t release_fire(uint8_t mask, uint32_t ticks)
{
    uint32_t reach = within_reach(ticks);
    uint32_t at = ticks_of(board_fire(mask, reach));
    pulse.sync = true;
    pulse.lasted = 0;
    pulse.ended_by = PULSE_END_ORDERED;
    if (mask == 0)
        return at; /* what had to rest goes on doing so */
    pulse.since = at;
    pulse.length = ticks;
    pulse.end = at + reach;
    pulse.on = true;
    if (ticks < BOARD_SHORT && board_release_high())
        end_now(PULSE_END_ORDERED);
    return at;
}

void release_off(uint8_t by)
{
    if (pulse.on && board_release_high())
        end_now(by);
    else if (pulse.on)
        release_pass(pulse.end);
}

void release_done(void)
{
    release_off(PULSE_END_ORDERED);
    pulse.sync = false;
    board_sync(false);
}

bool release_on(void)
{
    return pulse.on;
}

uint32_t release_lasted(uint8_t *by)
{
    *by = pulse.ended_by;
    return pulse.lasted;
}

void release_pass(uint32_t now)
{
    bool whole = pulse.end - pulse.since == pulse.length;
    if (!pulse.on) {
        if (pulse.resting && now - pulse.since >= pulse.length)
            pulse.resting = false;
    } else if (!board_release_high()) {
        uint32_t cut = board_release_cut();
        uint8_t by = whole ? PULSE_END_ORDERED : PULSE_END_DEVICE;
        ended(pulse.end - cut, cut ? PULSE_END_STOPPED : by);
    } else if (!whole) {
        if (pulse.end - now < BOARD_REACH - SOON)
            put_off(now);
    } else if ((int32_t)(now - pulse.end) > FAILED) {
        end_now(PULSE_END_DEVICE);
    }
}

uint16_t release_rest_ms(uint32_t now)
{
    if (!pulse.resting)
        return 0;
    return (uint16_t)((pulse.length - (now - pulse.since)) / TICKS_PER_MS + 1);
}
