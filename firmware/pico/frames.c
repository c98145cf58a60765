#include "frames.h"

#include <stdint.h>

#include "registers.h"

#define NUMBER 0x7FFu
#define SUSPENDED (1u << 4)
#define EARLY_US 800u
#define ENDED_US 10000u /* of frames: a lost one or two are no reason */

static uint32_t number;
static uint32_t began;  /* the frame, or a little earlier: when we looked before it had begun */
static uint32_t noticed; /* it was by then */
static uint32_t glanced;
static bool counted; /* at least one since we know nothing */

void frames_forget(void)
{
    number = REGISTER(USB_FRAME) & NUMBER;
    glanced = REGISTER(TIMER_RAW_LOW);
    counted = false;
}

void frames_pass(void)
{
    uint32_t now = REGISTER(TIMER_RAW_LOW), latest = REGISTER(USB_FRAME) & NUMBER;
    bool suspended = REGISTER(USB_SIE_STATUS) & SUSPENDED;
    if (latest != number) {
        number = latest;
        began = glanced;
        noticed = now;
        counted = true;
        if (suspended) /* no longer */
            REGISTER(USB_SIE_STATUS) = SUSPENDED;
    } else if (suspended) {
        counted = false;
    }
    glanced = now;
}

bool frames_early(void)
{
    return counted && REGISTER(TIMER_RAW_LOW) - began < EARLY_US;
}

bool frames_ended(void)
{
    return counted && glanced - noticed >= ENDED_US;
}
