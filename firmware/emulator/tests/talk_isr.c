/* SPDX-License-Identifier: GPL-3.0-or-later
 * The echo of talk.c with interrupts for both directions. */
#include "chip.h"

static volatile uint8_t ring[32];
static volatile uint8_t in, out;

#ifndef USART0_RX_vect
#define USART0_RX_vect USART_RX_vect
#define USART0_UDRE_vect USART_UDRE_vect
#endif

ISR(USART0_RX_vect)
{
    ring[in++ & 31] = (uint8_t)(UDR0 + 1);
    UCSR0B |= _BV(UDRIE0);
}

ISR(USART0_UDRE_vect)
{
    if (in == out)
        UCSR0B &= (uint8_t)~_BV(UDRIE0);
    else
        UDR0 = ring[out++ & 31];
}

int main(void)
{
    UCSR0A = _BV(U2X0);
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UBRR0 = 3;
    UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
    sei();
    for (;;) {}
}
