/* Where the RP2040 has its blocks, and what it has otherwise than its successor; section numbers are
 * those of its data sheet. */
#ifndef BLOCKS_H
#define BLOCKS_H

#define RESETS 0x4000C000u
#define RESET_IO_BANK0 (1u << 5)
#define RESET_PADS_BANK0 (1u << 8)
#define RESET_PIO0 (1u << 10)
#define RESET_PLL_SYS (1u << 12)
#define RESET_PLL_USB (1u << 13)
#define RESET_TIMER (1u << 21)
#define RESET_USB (1u << 24)
#define PSM 0x40010000u
#define PSM_ALL_BUT_CLOCKS 0x1FFFCu
#define BUS_PRIORITY 0x40030000u

/* 2.8.3 what its own program offers: where the list is; of each function two letters and a place */
#define ROM_FUNCTIONS 0x14u

/* 2.20.2 which chip it is */
#define CHIP_ID 0x40000000u
#define OLDER_THAN_B2 (REGISTER(CHIP_ID) >> 28 < 2) /* B0 or B1, of which E5 tells */

/* 2.12.7 why the chip started */
#define CHIP_RESET 0x40064008u
#define CHIP_RESET_PIN (1u << 16)

#define CLOCKS 0x40008000u
#define CLK_USB_CTRL (CLOCKS + 0x54u)
#define CLK_ADC_CTRL (CLOCKS + 0x60u)
#define XOSC 0x40024000u
#define PLL_SYS 0x40028000u
#define PLL_USB 0x4002C000u

#define IO_BANK0 0x40014000u
#define PADS_BANK0 0x4001C000u
#define SIO_OUT_SET 0xD0000014u
#define SIO_OUT_CLEAR 0xD0000018u
#define SIO_OE_SET 0xD0000024u

#define DMA_ABORT 0x50000444u
#define DMA_FOR_EVER 0xFFFFFFFFu
#define DMA_TO_RING(bits) (1u << 5 | (bits) << 6 | 1u << 10)
#define DMA_CHAIN_TO(channel) ((channel) << 11)
#define DMA_PACED_BY_RX(machine) ((4u + (machine)) << 15)
#define DMA_SILENT (1u << 21)

#define TIMER 0x40054000u
#define TIMER_INTR (TIMER + 0x34u)
#define TIMER_INTE (TIMER + 0x38u)
#define WATCHDOG 0x40058000u
#define WATCHDOG_TICK (WATCHDOG + 0x2Cu)
#define WATCHDOG_COUNTS 2u /* of a microsecond: it counts twice as fast as it says (E1) */
#define ADC 0x4004C000u

/* 4.10 the flash's interface */
#define SSI_CTRLR0 0x18000000u
#define SSI_SSIENR 0x18000008u
#define SSI_SR 0x18000028u
#define SSI_DR0 0x18000060u
#define QSPI_SELECT 0x4001800Cu

#define INTERRUPT_USB 5u

#endif
