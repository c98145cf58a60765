#include "board.h"

uint16_t reference_offset, release_offset;

void board_start(void)
{
    /* Outputs first: low, then driven. Inputs float or are pulled up until now. */
    PORTE &= (uint8_t)~(RELEASE_0 | RELEASE_1 | SYNC);
    DDRE |= RELEASE_0 | RELEASE_1 | SYNC;
    DDRA = LED;
    PORTA = STOP;
    PORTL = REFERENCE | SENSE;
    DDRB = DDRK = 0;
    PORTB = PORTK = 0xFF; /* a gate whose wire is broken reads blocked */

    TCCR3A = TCCR4A = TCCR5A = 0;
    TCCR3B = _BV(CS30);
    TCCR4B = _BV(ICNC4) | _BV(ICES4) | _BV(CS40);
    TCCR5B = _BV(ICNC5) | _BV(CS50);
    {
        uint16_t of3 = TCNT3, of4 = TCNT4, of5 = TCNT5;
        reference_offset = (uint16_t)(of5 - of4 - 4); /* each is read in four cycles */
        release_offset = (uint16_t)(of3 - of5 + 8);
    }
}
