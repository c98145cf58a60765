#include "board.h"

void board_start(void)
{
    /* Outputs first: low, then driven. */
    PORTB = STOP | REFERENCE;
    DDRB = RELEASE_0 | RELEASE_1 | SYNC | LED;
    DDRC = 0;
    DDRD &= 0x03;
    PORTC = 0x3F; /* a gate whose wire is broken reads blocked */
    PORTD |= 0xFC;

    TCCR1A = 0;
    TCCR1B = _BV(ICNC1) | _BV(ICES1) | _BV(CS10);
}
