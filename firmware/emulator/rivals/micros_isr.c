/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A rival for the benchmark: how a timing sketch for an Arduino is usually written. micros() in a
 * pin change interrupt, everything printed when the drop is over. Written for this project after
 * what the Arduino core does: timer 0 at clk/64 in fast PWM, its overflow interrupt keeping
 * milliseconds, micros() with interrupts off in steps of 4 us.
 */
#include "sketch.h"

static volatile uint32_t milliseconds;
static uint8_t fraction;

ISR(TIMER0_OVF_vect)
{
    /* An overflow is 1024 us: one millisecond and 24 us, kept in units of 8 us. */
    uint32_t m = milliseconds + 1;
    uint8_t f = (uint8_t)(fraction + 3);
    if (f >= 125) {
        f = (uint8_t)(f - 125);
        m++;
    }
    fraction = f;
    milliseconds = m;
    overflows++;
}

static void changed(void)
{
    uint16_t n = count;
    if (n < CAPACITY) {
        times[n] = micros();
        states[n] = GATES;
        count = n + 1;
    }
}

ISR(VECTOR_0) { changed(); }
ISR(VECTOR_1) { changed(); }

static void say(uint8_t byte)
{
    while (!(UCSR0A & _BV(UDRE0))) {}
    UDR0 = byte;
}

int main(void)
{
    uint16_t n;
    uint32_t start;
    begin(3);
    WATCH();
    RELEASE_ON();
    start = micros();
    fired = start;
    while (micros() - start < 900000) {}
    PCICR = 0;
    for (n = 0; n < count; n++)
        print(n);
    printed = 1;
    for (;;) {}
}
