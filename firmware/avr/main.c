/* Start-up and the endless loop of an AVR board. */
#include <avr/eeprom.h>
#include <avr/io.h>
#include <avr/wdt.h>

#include "board.h"
#include "device.h"

#define LINE_BAUD 500000
#ifndef BAUD
#define BAUD LINE_BAUD
#endif
#define UBRR_VALUE (F_CPU / 8 / BAUD - 1)
_Static_assert(F_CPU % (8 * BAUD) == 0, "this rate cannot be made exactly");

volatile uint16_t entries_lost;
uint8_t reset_cause BOARD_KEPT; /* set by start.S */

static uint8_t eeprom_name[8] EEMEM = {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF};

void board_name(uint8_t name[8])
{
    eeprom_read_block(name, eeprom_name, sizeof eeprom_name);
}

void board_rename(const uint8_t name[8])
{
    uint8_t n;
    for (n = 0; n < sizeof eeprom_name; n++) {
        eeprom_update_byte(eeprom_name + n, name[n]); /* 3.4 ms each */
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

int main(void)
{
    board_start();
    wdt_enable(WDTO_120MS);
    start_line();
    device_start(reset_cause);
    sei();
    for (;;)
        device_pass();
}
