/* Where the RP2350 has its blocks, and what it has otherwise than the RP2040; section numbers are
 * those of its data sheet. Whoever writes a pad's register, or USB's main one, ends an isolation that
 * the RP2040 does not know, for that bit is 0 in all that is written. */
#ifndef BLOCKS_H
#define BLOCKS_H

#define RESETS 0x40020000u
#define RESET_IO_BANK0 (1u << 6)
#define RESET_PADS_BANK0 (1u << 9)
#define RESET_PIO0 (1u << 11)
#define RESET_PLL_SYS (1u << 14)
#define RESET_PLL_USB (1u << 15)
#define RESET_TIMER (1u << 23)
#define RESET_USB (1u << 28)
#define PSM 0x40018000u
#define PSM_ALL_BUT_CLOCKS 0x01FFFFF3u
#define BUS_PRIORITY 0x40068000u

/* 5.4 what its own program offers: a function that finds the others by two letters */
#define ROM_LOOKUP 0x16u
#define ROM_SECURE 4u /* the kind of code that we are */

/* No chip of this kind has erratum RP2040-E5. */
#define OLDER_THAN_B2 0

/* 6.4 why the chip started */
#define CHIP_RESET 0x4010002Cu
#define CHIP_RESET_PIN (1u << 18)

/* 13 the memory that is written once, read as 16 bits a row: the chip's number is its first four */
#define OTP_ROW(row) (*(volatile uint16_t *)(0x40130000u + 2u * (row)))

#define CLOCKS 0x40010000u
#define CLK_USB_CTRL (CLOCKS + 0x60u)
#define CLK_ADC_CTRL (CLOCKS + 0x6Cu)
#define XOSC 0x40048000u
#define TICKS_TIMER 0x40108018u
#define TICKS_WATCHDOG 0x40108030u
#define TICKS_CYCLES(generator) ((generator) + 4u)
#define PLL_SYS 0x40050000u
#define PLL_USB 0x40058000u

#define IO_BANK0 0x40028000u
#define PADS_BANK0 0x40038000u
#define SIO_OUT_SET 0xD0000018u
#define SIO_OUT_CLEAR 0xD0000020u
#define SIO_OE_SET 0xD0000038u

#define DMA_ABORT 0x50000464u
#define DMA_FOR_EVER 0x0FFFFFFFu /* the upper four bits say what follows the end: nothing */
#define DMA_TO_RING(bits) (1u << 6 | (bits) << 8 | 1u << 12)
#define DMA_CHAIN_TO(channel) ((channel) << 13)
#define DMA_PACED_BY_RX(machine) ((4u + (machine)) << 17)
#define DMA_SILENT (1u << 23)

#define TIMER 0x400B0000u
#define TIMER_INTR (TIMER + 0x3Cu)
#define TIMER_INTE (TIMER + 0x40u)
#define WATCHDOG 0x400D8000u
#define WATCHDOG_COUNTS 1u /* of a microsecond */
#define ADC 0x400A0000u

#define INTERRUPT_USB 14u

#endif
