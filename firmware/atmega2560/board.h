/* Arduino Mega 2560: sixteen gates, two releases, release sense, 1 Hz reference. */
#ifndef BOARD_H
#define BOARD_H

#define BOARD_CAPACITY 1024
#define BOARD_STREAMS 0
#define BOARD_GATES 16
#define BOARD_GATE_MASK 0xFFFFu
#define BOARD_RELEASES 2
#define BOARD_BUSY 47 /* from one stamp to the next, of an edge that waited for the interrupt's end */
#define BOARD_LATENCY 8

#define BOARD_COUNTER TCNT5
#define BOARD_COUNTER_LOW TCNT5L
#define BOARD_COUNTER_HIGH TCNT5H

#ifdef __ASSEMBLER__

#include <avr/io.h>
#define BOARD_VECTOR_0 PCINT0_vect
#define BOARD_VECTOR_1 PCINT2_vect
#define BOARD_LOAD_PORT_0 in_port_b
#define BOARD_LOAD_PORT_1 lds_port_k
.macro in_port_b register
    in   \register, _SFR_IO_ADDR(PINB)
.endm
.macro lds_port_k register
    lds  \register, _SFR_MEM_ADDR(PINK)
.endm

#else

#define RELEASE_0 _BV(PE3) /* D5 */
#define RELEASE_1 _BV(PE5) /* D3 */
#define SYNC _BV(PE4)      /* D2 */
#define LED _BV(PA0)       /* D22 */
#define STOP _BV(PA2)      /* D24, closed to ground when all is well */
#define REFERENCE _BV(PL0) /* D49, ICP4 */
#define SENSE _BV(PL1)     /* D48, ICP5 */
#define RELEASE_PORT PORTE /* SYNC is on it too */
#define RELEASE_PIN PINE
#define RELEASE_COUNTER TCNT3 /* PE3 is OC3A, PE5 is OC3C */
#define RELEASE_MATCH_0 OCR3A
#define RELEASE_MATCH_1 OCR3C
#define RELEASE_UNITS TCCR3A
#define RELEASE_SET_0 (_BV(COM3A1) | _BV(COM3A0))
#define RELEASE_SET_1 (_BV(COM3C1) | _BV(COM3C0))
#define RELEASE_CLEAR_0 _BV(COM3A1)
#define RELEASE_CLEAR_1 _BV(COM3C1)
#define RELEASE_FORCE TCCR3C
#define RELEASE_FORCE_BOTH (_BV(FOC3A) | _BV(FOC3C))
#define STOP_PORT PINA
#define LED_PORT PORTA

#define SUPPLY_CHANNEL 0x1E /* the ADC's name of its reference voltage */
#define BOARD_INTERRUPTS (_BV(PCIE0) | _BV(PCIE2))

#include <stdint.h>

/* How far timer 5, which stamps, is ahead of timer 4, which catches the reference; and how far
 * timer 3, which ends the release, is ahead of timer 5. */
extern uint16_t reference_offset, release_offset;

#include "board_avr.h"

static const char board_type[] PROGMEM = "Arduino Mega 2560";
static const char board_channels[] PROGMEM =
    "D53 D52 D51 D50 D10 D11 D12 D13 A8 A9 A10 A11 A12 A13 A14 A15";

void board_start(void);

static inline uint16_t board_gates(void)
{
    return (uint16_t)(PINB | (uint16_t)PINK << 8);
}

static inline uint16_t board_gates_of(uint8_t port_0, uint8_t port_1)
{
    return (uint16_t)(port_0 | (uint16_t)port_1 << 8);
}

static inline uint16_t board_ports_of(uint16_t gates)
{
    return gates;
}

static inline void board_watch(uint16_t gates)
{
    PCMSK0 = (uint8_t)gates;
    PCMSK2 = (uint8_t)(gates >> 8);
    PCIFR = _BV(PCIF0) | _BV(PCIF2); /* what came before does not count */
    PCICR = BOARD_INTERRUPTS;
}

static inline bool board_reference(uint16_t *count)
{
    if (!caught(&TIFR4, _BV(ICF4), &ICR4, count))
        return false;
    *count = (uint16_t)(*count + reference_offset);
    return true;
}

/* Wait for whatever edge the input can make next. */
static inline void board_sense_begin(void)
{
    TCCR5B = (uint8_t)(PINL & SENSE ? _BV(ICNC5) | _BV(CS50) : _BV(ICNC5) | _BV(ICES5) | _BV(CS50));
    TIFR5 = _BV(ICF5);
}

static inline bool board_sensed(uint16_t *count)
{
    return caught(&TIFR5, _BV(ICF5), &ICR5, count);
}

#endif
#endif
