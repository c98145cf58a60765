/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * What both rival sketches share: the boards' pins, Arduino's usual micros() (timer 0 at clk/64 in
 * fast PWM; interrupts off, steps of 4 us), numbers in decimal, and where the results are found.
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
#define UDRE_VECTOR USART0_UDRE_vect
#else
#define CAPACITY 180
#define GATES (PIND >> 2 | (uint16_t)(PINC & 0x3F) << 6)
#define WATCH() (PCMSK2 = 0xFC, PCMSK1 = 0x3F, PCICR = _BV(PCIE1) | _BV(PCIE2))
#define VECTOR_0 PCINT1_vect
#define VECTOR_1 PCINT2_vect
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

static void say(uint8_t byte);

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

/* Everything set up, and a byte waited for; `divisor` sets the line's speed. */
static void begin(uint16_t divisor)
{
    UCSR0A = _BV(U2X0);
    UBRR0 = divisor;
    UCSR0B = _BV(RXEN0) | _BV(TXEN0);
    TCCR0A = _BV(WGM01) | _BV(WGM00);
    TCCR0B = _BV(CS01) | _BV(CS00);
    TIMSK0 = _BV(TOIE0);
    RELEASE_START();
    sei();
    while (!(UCSR0A & _BV(RXC0))) {}
    (void)UDR0;
}
