/* Arduino Uno (and Nano): twelve gates, two releases, 1 Hz reference; streams. */
#ifndef BOARD_H
#define BOARD_H

#define BOARD_CAPACITY 192
#define BOARD_STREAMS 1
#define BOARD_GATES 12
#define BOARD_GATE_MASK 0x0FFFu
#define BOARD_RELEASES 2
#define BOARD_BUSY 47 /* from one stamp to the next, of an edge that waited for the interrupt's end */
#define BOARD_LATENCY 7

#define BOARD_COUNTER TCNT1
#define BOARD_COUNTER_LOW TCNT1L
#define BOARD_COUNTER_HIGH TCNT1H

#ifdef __ASSEMBLER__

#include <avr/io.h>
#define BOARD_VECTOR_0 PCINT2_vect
#define BOARD_VECTOR_1 PCINT1_vect
#define BOARD_LOAD_PORT_0 in_port_d
#define BOARD_LOAD_PORT_1 in_port_c
.macro in_port_d register
    in   \register, _SFR_IO_ADDR(PIND)
.endm
.macro in_port_c register
    in   \register, _SFR_IO_ADDR(PINC)
.endm

#else

#define REFERENCE _BV(PB0) /* D8, ICP1 */
#define RELEASE_0 _BV(PB1) /* D9 */
#define RELEASE_1 _BV(PB2) /* D10 */
#define SYNC _BV(PB3)      /* D11 */
#define STOP _BV(PB4)      /* D12, closed to ground when all is well */
#define LED _BV(PB5)       /* D13 */
#define RELEASE_PORT PORTB /* SYNC is on it too */
#define RELEASE_PIN PINB
#define RELEASE_COUNTER TCNT1 /* PB1 is OC1A, PB2 is OC1B */
#define RELEASE_MATCH_0 OCR1A
#define RELEASE_MATCH_1 OCR1B
#define RELEASE_UNITS TCCR1A
#define RELEASE_SET_0 (_BV(COM1A1) | _BV(COM1A0))
#define RELEASE_SET_1 (_BV(COM1B1) | _BV(COM1B0))
#define RELEASE_CLEAR_0 _BV(COM1A1)
#define RELEASE_CLEAR_1 _BV(COM1B1)
#define RELEASE_FORCE TCCR1C
#define RELEASE_FORCE_BOTH (_BV(FOC1A) | _BV(FOC1B))
#define STOP_PORT PINB
#define LED_PORT PORTB

#define SUPPLY_CHANNEL 0x0E /* the ADC's name of its reference voltage */
#define BOARD_INTERRUPTS (_BV(PCIE1) | _BV(PCIE2))

enum { release_offset = 0 }; /* the timer that stamps ends the release too */

#include "board_avr.h"

static const char board_type[] PROGMEM = "Arduino Uno";
static const char board_channels[] PROGMEM = "D2 D3 D4 D5 D6 D7 A0 A1 A2 A3 A4 A5";

void board_start(void);

/* Gates 0 to 5 are PD2 to PD7, gates 6 to 11 are PC0 to PC5. */
static inline uint16_t board_gates_of(uint8_t port_0, uint8_t port_1)
{
    return (uint16_t)(port_0 >> 2 | (uint16_t)(port_1 & 0x3F) << 6);
}

static inline uint16_t board_ports_of(uint16_t gates)
{
    return (uint16_t)((uint8_t)(gates << 2) | (gates >> 6 & 0x3F) << 8);
}

static inline uint16_t board_gates(void)
{
    return board_gates_of(PIND, PINC);
}

static inline void board_watch(uint16_t gates)
{
    uint16_t ports = board_ports_of(gates);
    PCMSK2 = (uint8_t)ports;
    PCMSK1 = (uint8_t)(ports >> 8);
    PCIFR = _BV(PCIF1) | _BV(PCIF2); /* what came before does not count */
    PCICR = BOARD_INTERRUPTS;
}

static inline bool board_reference(uint16_t *count)
{
    return caught(&TIFR1, _BV(ICF1), &ICR1, count);
}

/* The one input-capture pin takes the reference: no release sense. */
static inline void board_sense_begin(void)
{
}

static inline bool board_sensed(uint16_t *count)
{
    (void)count;
    return false;
}

#endif
#endif
