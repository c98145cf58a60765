/* Start-up and the endless loop of an AVR board. */
#include <avr/eeprom.h>
#include <avr/io.h>
#include <avr/wdt.h>

#include "board.h"
#include "device.h"
#include "name.h"

#define LINE_BAUD 500000
#ifndef BAUD
#define BAUD LINE_BAUD
#endif
#define UBRR_VALUE (F_CPU / 8 / BAUD - 1)
_Static_assert(F_CPU % (8 * BAUD) == 0, "this rate cannot be made exactly");

volatile uint16_t entries_lost;
uint8_t reset_cause BOARD_KEPT; /* set by start.S */

/* Not at address 0, which a write that fails with the supply hits first. */
#define NAME_AT ((uint8_t *)0x40)

void board_name(uint8_t record[NAME_RECORD])
{
    eeprom_read_block(record, NAME_AT, NAME_RECORD);
}

void board_rename(const uint8_t record[NAME_RECORD])
{
    uint8_t n;
    for (n = 0; n < NAME_RECORD; n++) {
        eeprom_update_byte(NAME_AT + n, record[n]); /* 3.4 ms each */
        wdt_reset();
    }
}

static void start_line(void)
{
    UCSR0A = _BV(U2X0);
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UBRR0 = UBRR_VALUE;
    UCSR0B = _BV(RXEN0) | _BV(TXEN0);
}

static void start_supply(void)
{
    ADMUX = _BV(REFS0) | SUPPLY_CHANNEL;
    ADCSRB = 0; /* free running */
    ADCSRA = _BV(ADEN) | _BV(ADATE) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0) | _BV(ADSC);
}

int main(void)
{
    board_start();
    start_supply();
    wdt_enable(WDTO_120MS);
    start_line();
    device_start(reset_cause);
    sei();
    for (;;)
        device_pass();
}
