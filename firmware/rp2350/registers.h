/* The registers of the RP2350 that this firmware uses; section numbers are those of its data sheet.
 * Blocks that were taken over from the RP2040 kept their registers, at other addresses. */
#ifndef REGISTERS_H
#define REGISTERS_H

#include <stdint.h>

#define REGISTER(address) (*(volatile uint32_t *)(address))
/* The same register, where a write sets or clears the bits that it has (2.1.3). */
#define TO_SET(address) REGISTER((address) + 0x2000u)
#define TO_CLEAR(address) REGISTER((address) + 0x3000u)

/* 7.5 resets, 7.4 power-on state machine */
#define RESETS_RESET 0x40020000u
#define RESETS_DONE 0x40020008u
#define RESET_ADC (1u << 0)
#define RESET_BUSCTRL (1u << 1)
#define RESET_DMA (1u << 2)
#define RESET_IO_BANK0 (1u << 6)
#define RESET_PADS_BANK0 (1u << 9)
#define RESET_PIO0 (1u << 11)
#define RESET_PLL_SYS (1u << 14)
#define RESET_PLL_USB (1u << 15)
#define RESET_TIMER (1u << 23)
#define RESET_USB (1u << 28)
#define PSM_WDSEL 0x40018008u
#define PSM_ALL_BUT_CLOCKS 0x01FFFFF3u

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

/* 2.1.4 the bus: whose turn it is when several meet */
#define BUS_PRIORITY 0x40068000u
#define BUS_DMA_READS (1u << 8)
#define BUS_DMA_WRITES (1u << 12)

/* 8.1 clocks, 8.2 crystal, 8.5 ticks, 8.6 PLL */
#define CLK_REF_CTRL 0x40010030u
#define CLK_REF_SELECTED 0x40010038u
#define CLK_SYS_CTRL 0x4001003Cu
#define CLK_SYS_SELECTED 0x40010044u
#define CLK_USB_CTRL 0x40010060u
#define CLK_ADC_CTRL 0x4001006Cu
#define CLK_ENABLE (1u << 11)
#define XOSC_CTRL 0x40048000u
#define XOSC_STATUS 0x40048004u
#define XOSC_STARTUP 0x4004800Cu
#define TICKS_TIMER 0x40108018u
#define TICKS_WATCHDOG 0x40108030u
#define TICKS_CYCLES(generator) ((generator) + 4u)
#define PLL_SYS 0x40050000u
#define PLL_USB 0x40058000u

/* 9 pins; whoever writes a pad's register ends its isolation too, for that bit is not among these */
#define PINS_CTRL(pin) (0x40028004u + 8u * (pin))
#define FUNCTION_SIO 5u
#define FUNCTION_PIO0 6u
#define PADS(pin) (0x40038004u + 4u * (pin))
#define PAD_SCHMITT (1u << 1)
/* By erratum RP2350-E9 an input that is pulled down may stay at 2 V: only outputs are, here. */
#define PAD_PULL_DOWN (1u << 2)
#define PAD_PULL_UP (1u << 3)
#define PAD_4MA (1u << 4)
#define PAD_INPUT (1u << 6)
#define PAD_NO_OUTPUT (1u << 7)
#define SIO_IN 0xD0000004u
#define SIO_OUT_SET 0xD0000018u
#define SIO_OUT_CLEAR 0xD0000020u
#define SIO_OE_SET 0xD0000038u

/* 12.6 DMA; the upper four bits of a count say what follows its end: nothing */
#define DMA_READ(channel) (0x50000000u + 0x40u * (channel))
#define DMA_WRITE(channel) (0x50000004u + 0x40u * (channel))
#define DMA_COUNT(channel) (0x50000008u + 0x40u * (channel))
#define DMA_CTRL(channel) (0x5000000Cu + 0x40u * (channel))
#define DMA_ABORT 0x50000464u
#define DMA_FOR_EVER 0x0FFFFFFFu
#define DMA_ON (1u << 0)
#define DMA_FIRST (1u << 1)
#define DMA_WORDS (2u << 2)
#define DMA_TO_RING(bits) (1u << 6 | (bits) << 8 | 1u << 12)
#define DMA_CHAIN_TO(channel) ((channel) << 13)
#define DMA_PACED_BY_RX(machine) ((4u + (machine)) << 17)
#define DMA_SILENT (1u << 23)

/* 11 PIO */
#define PIO_CTRL 0x50200000u
#define PIO_FSTAT 0x50200004u
#define PIO_RX_EMPTY (1u << 8) /* of machine 0, as the next */
#define PIO_FDEBUG 0x50200008u
#define PIO_LOST_WORD (1u << 0) /* a push found no room; writing it clears it */
#define PIO_TX(machine) (0x50200010u + 4u * (machine))
#define PIO_RX(machine) (0x50200020u + 4u * (machine))
#define PIO_MEMORY(at) (0x50200048u + 4u * (at))
#define PIO_CLKDIV(machine) (0x502000C8u + 0x18u * (machine))
#define PIO_EXECCTRL(machine) (0x502000CCu + 0x18u * (machine))
#define PIO_SHIFTCTRL(machine) (0x502000D0u + 0x18u * (machine))
#define PIO_INSTR(machine) (0x502000D8u + 0x18u * (machine))
#define PIO_PINCTRL(machine) (0x502000DCu + 0x18u * (machine))

/* 12.8 timer, 12.9 watchdog */
#define TIMER_RAW_LOW 0x400B0028u
#define TIMER_ALARM0 0x400B0010u
#define TIMER_INTR 0x400B003Cu
#define TIMER_INTE 0x400B0040u
#define WATCHDOG_CTRL 0x400D8000u
#define WATCHDOG_LOAD 0x400D8004u
#define WATCHDOG_REASON 0x400D8008u
#define WATCHDOG_COUNTS 1u /* of a microsecond */

/* 12.4 ADC */
#define ADC_CS 0x400A0000u
#define ADC_RESULT 0x400A0004u
#define ADC_ON (1u << 0)
#define ADC_START (1u << 2)
#define ADC_READY (1u << 8)
#define ADC_CHANNEL(n) ((n) << 12)

/* 12.7 USB; whoever writes its main register ends the transceiver's isolation too */
#define USB_MEMORY 0x50100000u
#define USB_IN(endpoint) (USB_MEMORY + 0x80u + 8u * (endpoint))
#define USB_OUT(endpoint) (USB_MEMORY + 0x84u + 8u * (endpoint))
#define USB_IN_CTRL(endpoint) (USB_MEMORY + 8u * (endpoint))
#define USB_OUT_CTRL(endpoint) (USB_MEMORY + 4u + 8u * (endpoint))
#define USB_ADDRESS 0x50110000u
#define USB_MAIN_CTRL 0x50110040u
#define USB_FRAME 0x50110048u
#define USB_SIE_CTRL 0x5011004Cu
#define USB_SIE_STATUS 0x50110050u
#define USB_BUFFERS 0x50110058u
#define USB_ABORT 0x50110060u
#define USB_ABORT_DONE 0x50110064u
#define USB_STALL_ARM 0x50110068u
#define USB_MUXING 0x50110074u
#define USB_POWER 0x50110078u
#define USB_INTE 0x50110090u

/* The processor's own */
#define NVIC_ENABLE 0xE000E100u
#define NVIC_DISABLE 0xE000E180u
#define INTERRUPT_TIMER 0u
#define INTERRUPT_USB 14u

#endif
