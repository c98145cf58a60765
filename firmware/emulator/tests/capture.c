/* SPDX-License-Identifier: GPL-3.0-or-later
 * Input capture, rising edges: timers 4 and 5 of a 2560, timer 1 of a 328P; all started in step
 * with the output's rise. Timer flags are cleared one by one when `clear` is set. */
#include "chip.h"

volatile uint16_t captured[2];
volatile uint8_t count[2], clear, flags_before, flags_after;

#ifdef __AVR_ATmega2560__
#define FLAGS TIFR5
#define OVERFLOW TOV5
ISR(TIMER4_CAPT_vect) { captured[0] = ICR4; count[0]++; }
ISR(TIMER5_CAPT_vect) { captured[1] = ICR5; count[1]++; }
#else
#define FLAGS TIFR1
#define OVERFLOW TOV1
ISR(TIMER1_CAPT_vect) { captured[0] = ICR1; count[0]++; }
#endif

int main(void)
{
    OUT_DDR = _BV(OUT_BIT);
#ifdef __AVR_ATmega2560__
    TCCR5B = _BV(ICES5) | _BV(CS50);
    OUT_PORT = _BV(OUT_BIT);
    TCCR4B = _BV(ICES4) | _BV(CS40);
    TIMSK4 = _BV(ICIE4);
    TIMSK5 = _BV(ICIE5);
#else
    TCCR1B = _BV(ICES1) | _BV(CS10);
    OUT_PORT = _BV(OUT_BIT);
    TIMSK1 = _BV(ICIE1);
#endif
    sei();
    for (;;) {
        if (clear) {
            cli();
            flags_before = FLAGS;
            if (clear == 1)
                FLAGS = _BV(OVERFLOW);
            else
                FLAGS |= _BV(OVERFLOW); /* one SBI: silicon touches that flag alone */
            flags_after = FLAGS;
            clear = 0;
        }
    }
}
