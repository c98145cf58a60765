#include "board.h"

void board_start(void)
{
    /* Outputs first: low, then driven. */
    PORTB = STOP | REFERENCE;
    DDRB = RELEASE_0 | RELEASE_1 | SYNC | LED;
    DDRC = 0;
    DDRD &= 0x03;
    PORTC = 0; /* the comparators drive the gate inputs */
    PORTD &= 0x03;

    TCCR1A = 0;
    TCCR1B = _BV(ICNC1) | _BV(ICES1) | _BV(CS10);
}
