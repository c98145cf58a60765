/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A rival for the benchmark: the sketch without interrupts of its own. A loop reads the gates, and
 * when they have changed it takes micros() and prints at once, at Arduino's usual 115200 baud
 * through a transmit buffer of 64 bytes emptied by interrupt. With PRINT_LATER it only stores.
 *
 * The release output rises when a byte comes in. Results: `count`, `times` (us), `states`, `fired`.
 */
#include <avr/interrupt.h>
#include <avr/io.h>

#ifdef __AVR_ATmega2560__
#define CAPACITY 800
#define GATES (PINB | (uint16_t)PINK << 8)
#define RELEASE_START() (DDRE |= _BV(PE3) | _BV(PE4))
#define RELEASE_ON() (PORTE |= _BV(PE3) | _BV(PE4))
#define UDRE_VECTOR USART0_UDRE_vect
#else
#define CAPACITY 180
#define GATES (PIND >> 2 | (uint16_t)(PINC & 0x3F) << 6)
#define RELEASE_START() (DDRB |= _BV(PB1) | _BV(PB3))
#define RELEASE_ON() (PORTB |= _BV(PB1) | _BV(PB3))
#define UDRE_VECTOR USART_UDRE_vect
#endif

volatile uint16_t count;
volatile uint32_t times[CAPACITY];
volatile uint16_t states[CAPACITY];
volatile uint32_t fired;
volatile uint8_t printed;

static volatile uint32_t overflows;
static volatile uint8_t buffer[64], in, out;

ISR(TIMER0_OVF_vect) { overflows++; }

ISR(UDRE_VECTOR)
{
    UDR0 = buffer[out & 63];
    out++;
    if (in == out)
        UCSR0B &= (uint8_t)~_BV(UDRIE0);
}

static uint32_t micros(void)
{
    uint8_t sreg = SREG, low;
    uint32_t high;
    cli();
    high = overflows;
    low = TCNT0;
    if ((TIFR0 & _BV(TOV0)) && low < 255)
        high++;
    SREG = sreg;
    return (high << 8 | low) * 4;
}

static void say(uint8_t byte)
{
    while ((uint8_t)(in - out) >= sizeof buffer) {}
    buffer[in & 63] = byte;
    in++;
    UCSR0B |= _BV(UDRIE0);
}

static void say_number(uint32_t value)
{
    char digits[10];
    uint8_t n = 0;
    do
        digits[n++] = (char)('0' + value % 10);
    while (value /= 10);
    while (n)
        say((uint8_t)digits[--n]);
}

static void print(uint16_t n)
{
    say_number(times[n] - fired);
    say(',');
    say_number(states[n]);
    say('\n');
}

int main(void)
{
    uint16_t before, now, n;
    UCSR0A = _BV(U2X0);
    UBRR0 = 16;
    UCSR0B = _BV(RXEN0) | _BV(TXEN0);
    TCCR0A = _BV(WGM01) | _BV(WGM00);
    TCCR0B = _BV(CS01) | _BV(CS00);
    TIMSK0 = _BV(TOIE0);
    RELEASE_START();
    sei();
    while (!(UCSR0A & _BV(RXC0))) {}
    (void)UDR0;
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
