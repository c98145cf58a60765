/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A rival for the benchmark: how a timing sketch for an Arduino is usually written. micros() in a
 * pin change interrupt, everything printed when the drop is over. Written for this project after
 * what the Arduino core does: timer 0 at clk/64 in fast PWM, its overflow interrupt keeping
 * milliseconds, micros() with interrupts off in steps of 4 us.
 *
 * The release output rises when a byte comes in. Results: `count`, `times` (us), `states`, `fired`.
 */
#include <avr/interrupt.h>
#include <avr/io.h>

#ifdef __AVR_ATmega2560__
#define CAPACITY 800
#define GATES (PINB | (uint16_t)PINK << 8)
#define WATCH() (PCMSK0 = 0xFF, PCMSK2 = 0xFF, PCICR = _BV(PCIE0) | _BV(PCIE2))
#define VECTOR_0 PCINT0_vect
#define VECTOR_1 PCINT2_vect
#define RELEASE_START() (DDRE |= _BV(PE3) | _BV(PE4))
#define RELEASE_ON() (PORTE |= _BV(PE3) | _BV(PE4))
#else
#define CAPACITY 180
#define GATES (PIND >> 2 | (uint16_t)(PINC & 0x3F) << 6)
#define WATCH() (PCMSK2 = 0xFC, PCMSK1 = 0x3F, PCICR = _BV(PCIE1) | _BV(PCIE2))
#define VECTOR_0 PCINT1_vect
#define VECTOR_1 PCINT2_vect
#define RELEASE_START() (DDRB |= _BV(PB1) | _BV(PB3))
#define RELEASE_ON() (PORTB |= _BV(PB1) | _BV(PB3))
#endif

volatile uint16_t count;
volatile uint32_t times[CAPACITY];
volatile uint16_t states[CAPACITY];
volatile uint32_t fired;
volatile uint8_t printed;

static volatile uint32_t overflows;
static volatile uint32_t milliseconds;
static uint8_t fraction;

ISR(TIMER0_OVF_vect)
{
    /* An overflow is 1024 us: one millisecond and 24 us, kept in units of 8 us. */
    uint32_t m = milliseconds + 1;
    uint8_t f = (uint8_t)(fraction + 3);
    if (f >= 125) {
        f = (uint8_t)(f - 125);
        m++;
    }
    fraction = f;
    milliseconds = m;
    overflows++;
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

static void changed(void)
{
    uint16_t n = count;
    if (n < CAPACITY) {
        times[n] = micros();
        states[n] = GATES;
        count = n + 1;
    }
}

ISR(VECTOR_0) { changed(); }
ISR(VECTOR_1) { changed(); }

static void say(uint8_t byte)
{
    while (!(UCSR0A & _BV(UDRE0))) {}
    UDR0 = byte;
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

int main(void)
{
    uint16_t n;
    uint32_t start;
    UCSR0A = _BV(U2X0);
    UBRR0 = 3;
    UCSR0B = _BV(RXEN0) | _BV(TXEN0);
    TCCR0A = _BV(WGM01) | _BV(WGM00);
    TCCR0B = _BV(CS01) | _BV(CS00);
    TIMSK0 = _BV(TOIE0);
    RELEASE_START();
    sei();
    while (!(UCSR0A & _BV(RXC0))) {}
    (void)UDR0;
    WATCH();
    RELEASE_ON();
    start = micros();
    fired = start;
    while (micros() - start < 900000) {}
    PCICR = 0;
    for (n = 0; n < count; n++) {
        say_number(times[n] - start);
        say(',');
        say_number(states[n]);
        say('\n');
    }
    printed = 1;
    for (;;) {}
}
