/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A rival for the benchmark, on a Pico: a loop that does nothing but read all gates and, when they
 * have changed, the chip's own timer, which counts microseconds. It prints nothing. What MicroPython
 * or an interrupt would do is slower than this.
 */
#include "clocks.h"
#include "registers.h"

#define CAPACITY 3400
#define GATES ((uint16_t)REGISTER(SIO_IN))

volatile uint32_t times[CAPACITY];
volatile uint16_t states[CAPACITY];
volatile uint32_t count;

void timer_interrupt(void) {}
void usb_interrupt(void) {}

int main(void)
{
    uint16_t before, now;
    uint32_t pin;
    clocks_start();
    blocks_start(RESET_IO_BANK0 | RESET_PADS_BANK0);
    for (pin = 0; pin < 16; pin++)
        REGISTER(PADS(pin)) = PAD_INPUT | PAD_SCHMITT | PAD_PULL_UP | PAD_NO_OUTPUT;
    before = GATES;
    for (;;) {
        now = GATES;
        if (now != before && count < CAPACITY) {
            times[count] = REGISTER(TIMER_RAW_LOW);
            states[count++] = now;
            before = now;
        }
    }
}
