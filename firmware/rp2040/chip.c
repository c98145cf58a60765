#include "chip.h"

#include "board.h"
#include "registers.h"

#define START_USB_BOOT ('U' | 'B' << 8)

#define READ_NUMBER 0x4B
#define BEFORE 5 /* bytes: the command and four that say nothing */
#define BYTES_OF_EIGHT (7u << 16)
#define ROOM (1u << 1)
#define RECEIVED (1u << 3)
#define DRIVE_LOW (2u << 8)
#define DRIVE_HIGH (3u << 8)

static uint8_t exchange(uint8_t byte)
{
    while (!(REGISTER(SSI_SR) & ROOM))
        ;
    REGISTER(SSI_DR0) = byte;
    while (!(REGISTER(SSI_SR) & RECEIVED))
        ;
    return (uint8_t)REGISTER(SSI_DR0);
}

void chip_number(uint8_t number[8])
{
    uint8_t n;
    REGISTER(SSI_SSIENR) = 0;
    REGISTER(SSI_CTRLR0) = BYTES_OF_EIGHT;
    REGISTER(SSI_SSIENR) = 1;
    REGISTER(QSPI_SELECT) = DRIVE_LOW;
    for (n = 0; n < BEFORE; n++)
        exchange(n == 0 ? READ_NUMBER : 0);
    for (n = 0; n < 8; n++)
        number[n] = exchange(0);
    REGISTER(QSPI_SELECT) = DRIVE_HIGH;
}

void chip_ticks(uint32_t crystal_mhz)
{
    REGISTER(WATCHDOG_TICK) = 1u << 9 | crystal_mhz;
}

void chip_boot(void)
{
    const uint16_t *function = (const uint16_t *)(uintptr_t)*(volatile uint16_t *)ROM_FUNCTIONS;
    while (*function && *function != START_USB_BOOT)
        function += 2;
    if (*function)
        ((void (*)(uint32_t, uint32_t))(uintptr_t)(function[1] | 1u))(1u << LED, 0);
}
