/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A rival for the benchmark: the sketch without interrupts of its own. A loop reads the gates, and
 * when they have changed it takes micros() and prints at once, at Arduino's usual 115200 baud
 * through a transmit buffer of 64 bytes emptied by interrupt. With PRINT_LATER it only stores.
 */
#include "sketch.h"

static volatile uint8_t buffer[64], in, out;

ISR(TIMER0_OVF_vect) { overflows++; }

ISR(UDRE_VECTOR)
{
    UDR0 = buffer[out & 63];
    out++;
    if (in == out)
        UCSR0B &= (uint8_t)~_BV(UDRIE0);
}

static void say(uint8_t byte)
{
    while ((uint8_t)(in - out) >= sizeof buffer) {}
    buffer[in & 63] = byte;
    in++;
    UCSR0B |= _BV(UDRIE0);
}

int main(void)
{
    uint16_t before, now, n;
    begin(16);
    before = GATES;
    RELEASE_ON();
    fired = micros();
    while (micros() - fired < 900000) {
        now = GATES;
        n = count;
        if (now != before && n < CAPACITY) {
            times[n] = micros();
            states[n] = now;
            count = n + 1;
            before = now;
#ifndef PRINT_LATER
            print(n);
#endif
        }
    }
#ifdef PRINT_LATER
    for (n = 0; n < count; n++)
        print(n);
#endif
    printed = 1;
    for (;;) {}
}
