/* SPDX-License-Identifier: GPL-3.0-or-later
 * Stamps pin changes of two ports. The interrupts may use r24 and r25 without saving them: the
 * main program ends in an empty loop, so that the first instruction of each is the stamp. */
#include "chip.h"

volatile uint16_t zero; /* what the timer said one cycle after the output went high */
volatile uint16_t stamp_b, stamp_other;
volatile uint8_t level_b, level_other, count_b, count_other;

#define STAMP(vector, stamp, level, pin, count)                                             \
    ISR(vector, ISR_NAKED)                                                                  \
    {                                                                                       \
        __asm__ volatile("lds r24, %[low]  \n lds r25, %[high] \n sts %[to], r24 \n"        \
                         "sts %[to]+1, r25 \n lds r24, %[from] \n sts %[lev], r24 \n"       \
                         "lds r24, %[n] \n subi r24, 255 \n sts %[n], r24 \n reti"          \
                         :                                                                  \
                         : [low] "n"(_SFR_MEM_ADDR(TCNTL)), [high] "n"(_SFR_MEM_ADDR(TCNTH)), \
                           [to] "i"(&stamp), [from] "n"(_SFR_MEM_ADDR(pin)), [lev] "i"(&level), \
                           [n] "i"(&count));                                                \
    }

STAMP(PCINT0_vect, stamp_b, level_b, PINB, count_b)
STAMP(OTHER_VECT, stamp_other, level_other, OTHER_PIN, count_other)

int main(void)
{
    uint8_t low, high;
    PORTB = 0xFF; /* pull-ups everywhere */
    OTHER_PORT = 0xFF;
    OUT_DDR = _BV(OUT_BIT);
    START_TIMER();
    __asm__ volatile("out %[port], %[on] \n lds %[low], %[tl] \n lds %[high], %[th]"
                     : [low] "=&r"(low), [high] "=&r"(high)
                     : [port] "I"(_SFR_IO_ADDR(OUT_PORT)), [on] "r"((uint8_t)_BV(OUT_BIT)),
                       [tl] "n"(_SFR_MEM_ADDR(TCNTL)), [th] "n"(_SFR_MEM_ADDR(TCNTH)));
    zero = low | (uint16_t)high << 8;
    PCMSK0 = 0xFF;
    OTHER_MASK = 0xFF;
    PCIFR = _BV(PCIF0) | _BV(OTHER_FLAG);
    PCICR = _BV(PCIE0) | _BV(OTHER_ENABLE);
    PORTB = 0xFE; /* a write must not change what is driven from outside */
    PORTB = 0xFF;
    OTHER_PORT = 0xFE;
    OTHER_PORT = 0xFF;
    sei();
    __asm__ volatile("1: rjmp 1b");
    return 0;
}
