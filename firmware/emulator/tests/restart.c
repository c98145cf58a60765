/* SPDX-License-Identifier: GPL-3.0-or-later
 * Notes why it started, in RAM that no start clears; kicks its watchdog unless told not to. */
#include "chip.h"
#include <avr/eeprom.h>
#include <avr/sleep.h>
#include <avr/wdt.h>

volatile uint8_t causes[8] __attribute__((section(".noinit")));
volatile uint8_t boots __attribute__((section(".noinit")));
volatile uint8_t hang, cleared = 7, stored;
volatile uint16_t ticks;

int main(void)
{
    if (MCUSR & _BV(PORF))
        boots = 0;
    causes[boots++ & 7] = MCUSR;
    MCUSR = 0;
    wdt_enable(WDTO_15MS);
    stored = eeprom_read_byte((const uint8_t *)5);
    eeprom_write_byte((uint8_t *)6, boots);
    OUT_DDR = _BV(OUT_BIT);
    OUT_PORT = _BV(OUT_BIT);
    cleared = 0;
    for (;;) {
        ticks++;
        switch (hang) {
        case 0: wdt_reset(); break;
        case 1: break;
        case 2: wdt_disable(); cli(); sleep_mode(); break;
        default: wdt_disable(); *(volatile uint8_t *)0xFFF0 = 1; break;
        }
    }
}
