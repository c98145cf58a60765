/* SPDX-License-Identifier: GPL-3.0-or-later
 * What differs between the two controllers, for the programs beside this file. */
#ifndef CHIP_H
#define CHIP_H
#include <avr/interrupt.h>
#include <avr/io.h>

#ifdef __AVR_ATmega2560__
#define TCNTL TCNT5L
#define TCNTH TCNT5H
#define START_TIMER() (TCCR5B = _BV(CS50))
#define OTHER_PIN PINK
#define OTHER_PORT PORTK
#define OTHER_MASK PCMSK2
#define OTHER_VECT PCINT2_vect
#define OTHER_ENABLE PCIE2
#define OTHER_FLAG PCIF2
#define OUT_DDR DDRA
#define OUT_PORT PORTA
#define OUT_PIN PINA
#define OUT_BIT PA0
#else
#define TCNTL TCNT1L
#define TCNTH TCNT1H
#define START_TIMER() (TCCR1B = _BV(CS10))
#define OTHER_PIN PIND
#define OTHER_PORT PORTD
#define OTHER_MASK PCMSK2
#define OTHER_VECT PCINT2_vect
#define OTHER_ENABLE PCIE2
#define OTHER_FLAG PCIF2
#define OUT_DDR DDRC
#define OUT_PORT PORTC
#define OUT_PIN PINC
#define OUT_BIT PC0
#endif
#endif
