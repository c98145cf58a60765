/* Start-up and the endless loop. */
#include "board.h"
#include "bytes.h"
#include "capture.h"
#include "chip.h"
#include "clocks.h"
#include "device.h"
#include "events.h"
#include "name.h"
#include "receive.h"
#include "registers.h"
#include "send.h"
#include "usb.h"

#define WATCHDOG_US 120000u
#define WATCHDOG_ON (1u << 30)
#define NAP_US 40u              /* between two turns of the loop with nothing to do */

#define BOOT_POWER 1
#define BOOT_PIN 2
#define BOOT_WATCHDOG 8

#define SUPPLY_ADC 3u
#define ADC_FULL 4096u
#define ADC_FULL_MV 3300u
#define DIVIDER 3u

static uint8_t record[NAME_RECORD];

/* -- the rest of what the core asks for */

bool board_stopped(void)
{
    return REGISTER(SIO_IN) >> STOP & 1;
}

uint16_t board_supply(void)
{
    uint16_t measured;
    if (!(REGISTER(ADC_CS) & ADC_READY))
        return 0;
    measured = (uint16_t)(ADC_FULL - REGISTER(ADC_RESULT));
    REGISTER(ADC_CS) = ADC_ON | ADC_CHANNEL(SUPPLY_ADC) | ADC_START;
    return measured;
}

uint16_t board_supply_mv(uint16_t measured)
{
    return measured ? (uint16_t)((ADC_FULL - measured) * ADC_FULL_MV * DIVIDER / ADC_FULL) : 0;
}

/* It flickers where an old chip waits for a host that may never see it. */
void board_led(bool on)
{
    if (usb_unseen())
        on = REGISTER(TIMER_RAW_LOW) >> 16 & 1;
    REGISTER(on ? SIO_OUT_SET : SIO_OUT_CLEAR) = 1u << LED;
}

void board_kick(void)
{
    REGISTER(WATCHDOG_LOAD) = WATCHDOG_COUNTS * WATCHDOG_US;
}

/* A number that no other board has: that of the flash chip, or of the processor. */
void board_name(uint8_t to[])
{
    uint8_t n;
    for (n = 0; n < NAME_RECORD; n++)
        to[n] = record[n];
}

void board_rename(const uint8_t unused[])
{
    (void)unused;
}

void board_boot(void)
{
    if (usb_taken())
        chip_boot();
}

/* -- the start */

static uint8_t cause(void)
{
    uint32_t chip = REGISTER(CHIP_RESET);
    if (REGISTER(WATCHDOG_REASON) & 3)
        return BOOT_WATCHDOG;
    return chip & CHIP_RESET_PIN ? BOOT_PIN : BOOT_POWER;
}

static void start_pins(void)
{
    uint32_t pin;
    blocks_start(RESET_IO_BANK0 | RESET_PADS_BANK0);
    for (pin = 0; pin < 30; pin++) {
        bool output = pin == RELEASE_0 || pin == RELEASE_1 || pin == SYNC;
        bool input = pin < BOARD_GATES || pin == STOP || pin == SENSE || pin == REFERENCE;
        if (output)
            REGISTER(PADS(pin)) = PAD_INPUT | PAD_SCHMITT | PAD_PULL_DOWN | PAD_4MA;
        else if (input) /* a wire that is broken reads blocked, or stop */
            REGISTER(PADS(pin)) = PAD_INPUT | PAD_SCHMITT | PAD_PULL_UP | PAD_NO_OUTPUT;
        else if (pin == LED)
            REGISTER(PADS(pin)) = PAD_4MA;
        else
            REGISTER(PADS(pin)) = PAD_NO_OUTPUT;
    }
    REGISTER(SIO_OE_SET) = 1u << LED;
    REGISTER(PINS_CTRL(LED)) = FUNCTION_SIO;
}

static void start_supply(void)
{
    blocks_start(RESET_ADC);
    REGISTER(ADC_CS) = ADC_ON | ADC_CHANNEL(SUPPLY_ADC);
    while (!(REGISTER(ADC_CS) & ADC_READY))
        ;
    REGISTER(ADC_CS) = ADC_ON | ADC_CHANNEL(SUPPLY_ADC) | ADC_START;
}

static void start_watchdog(void)
{
    REGISTER(PSM_WDSEL) = PSM_ALL_BUT_CLOCKS;
    board_kick();
    TO_SET(WATCHDOG_CTRL) = WATCHDOG_ON;
}

/* -- the loop */

void timer_interrupt(void)
{
    REGISTER(TIMER_INTR) = 1;
}

/* The loop will see what USB wants. */
void usb_interrupt(void)
{
    REGISTER(NVIC_DISABLE) = 1u << INTERRUPT_USB;
}

static void nap(void)
{
    REGISTER(TIMER_ALARM0) = REGISTER(TIMER_RAW_LOW) + NAP_US;
    REGISTER(NVIC_ENABLE) = 1u << INTERRUPT_USB;
    __asm__ volatile("wfi");
}

int main(void)
{
    uint8_t why = cause();
    clocks_start();
    start_pins();
    blocks_start(RESET_PIO0 | RESET_DMA | RESET_BUSCTRL);
    start_supply();
    chip_number(record + 2);
    name_seal(record);
    usb_start(record + 2);
    REGISTER(TIMER_INTE) = 1;
    REGISTER(NVIC_ENABLE) = 1u << INTERRUPT_TIMER;
    start_watchdog();
    capture_start();
    device_start(why);
    for (;;) {
        device_pass();
        usb_pass(send_idle());
        if (events.sent == events.count && send_idle() && receive_idle() && events_settled())
            nap();
    }
}
