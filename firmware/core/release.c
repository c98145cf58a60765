#include "release.h"

#include "board.h"
#include "ticks.h"

static struct {
    uint32_t since, length; /* of the pulse, or of the rest after it, in ticks */
    bool on, resting, sync;
} pulse;

void release_reset(void)
{
    pulse.on = pulse.resting = pulse.sync = false;
    board_outputs(0, false);
}

uint32_t release_fire(uint8_t mask, uint32_t pulse_us)
{
    pulse.length = pulse_us * TICKS_PER_US;
    pulse.sync = true;
    pulse.on = mask != 0;
    pulse.since = ticks_of(board_fire(mask));
    return pulse.since;
}

void release_off(void)
{
    board_outputs(0, pulse.sync);
    if (pulse.on) {
        uint32_t now = ticks_now();
        pulse.length = (now - pulse.since) * RELEASE_REST;
        pulse.since = now;
        pulse.on = false;
        pulse.resting = true;
    }
}

void release_done(void)
{
    release_off();
    pulse.sync = false;
    board_outputs(0, false);
}

bool release_on(void)
{
    return pulse.on;
}

void release_pass(uint32_t now)
{
    if (pulse.on && now - pulse.since >= pulse.length)
        release_off();
    else if (pulse.resting && now - pulse.since >= pulse.length)
        pulse.resting = false;
}

uint16_t release_rest_ms(uint32_t now)
{
    if (!pulse.resting)
        return 0;
    return (uint16_t)((pulse.length - (now - pulse.since)) / TICKS_PER_MS + 1);
}
