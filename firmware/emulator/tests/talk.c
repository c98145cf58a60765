/* SPDX-License-Identifier: GPL-3.0-or-later
 * Polls its UART at 500 kbaud: 'w' makes it deaf for 2000 cycles, 't' makes it say 20 bytes,
 * anything else comes back one higher. */
#define F_CPU 16000000UL
#include "chip.h"
#include <util/delay.h>

#ifndef UBRR
#define UBRR 3
#endif

static void say(uint8_t byte)
{
    while (!(UCSR0A & _BV(UDRE0))) {}
    UDR0 = byte;
}

int main(void)
{
    UCSR0A = _BV(U2X0);
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UBRR0 = UBRR;
    UCSR0B = _BV(RXEN0) | _BV(TXEN0);
    for (;;) {
        while (!(UCSR0A & _BV(RXC0))) {}
        uint8_t byte = UDR0;
        if (byte == 'w') {
            _delay_loop_2(500);
        } else if (byte == 't') {
            for (uint8_t n = 0; n < 20; n++)
                say((uint8_t)('a' + n));
        } else {
            say((uint8_t)(byte + 1));
        }
    }
}
