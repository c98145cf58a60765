#include "chip.h"

#include "registers.h"

#define REBOOT ('R' | 'B' << 8)
#define TO_ITS_OWN_PROGRAM (0x002u | 0x100u) /* and do not come back */
#define REBOOT_AFTER_MS 10u
#define NUMBER_ROWS 4u

typedef int reboot_function(uint32_t what, uint32_t after_ms, uint32_t first, uint32_t second);
typedef uintptr_t lookup_function(uint32_t letters, uint32_t kind);

void chip_ticks(uint32_t crystal_mhz)
{
    REGISTER(TICKS_CYCLES(TICKS_TIMER)) = crystal_mhz;
    REGISTER(TICKS_TIMER) = 1;
    REGISTER(TICKS_CYCLES(TICKS_WATCHDOG)) = crystal_mhz;
    REGISTER(TICKS_WATCHDOG) = 1;
}

/* The processor's own number, and not the flash chip's: no two have the same. */
void chip_number(uint8_t number[8])
{
    uint32_t row;
    for (row = 0; row < NUMBER_ROWS; row++) {
        uint16_t part = OTP_ROW(NUMBER_ROWS - 1 - row);
        number[2 * row] = (uint8_t)(part >> 8);
        number[2 * row + 1] = (uint8_t)part;
    }
}

void chip_boot(void)
{
    uintptr_t lookup = *(volatile uint16_t *)ROM_LOOKUP;
    uintptr_t reboot = ((lookup_function *)lookup)(REBOOT, ROM_SECURE);
    if (reboot)
        ((reboot_function *)reboot)(TO_ITS_OWN_PROGRAM, REBOOT_AFTER_MS, 0, 0);
}
