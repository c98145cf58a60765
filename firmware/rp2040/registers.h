/* The registers of the RP2040 that this firmware uses; section numbers are those of its data sheet. */
#ifndef REGISTERS_H
#define REGISTERS_H

#include <stdint.h>

#define REGISTER(address) (*(volatile uint32_t *)(address))
/* The same register, where a write sets or clears the bits that it has (2.1.2). */
#define TO_SET(address) REGISTER((address) + 0x2000u)
#define TO_CLEAR(address) REGISTER((address) + 0x3000u)

/* 2.14 resets, 2.13 power-on state machine */
#define RESETS_RESET 0x4000C000u
#define RESETS_DONE 0x4000C008u
#define RESET_ADC (1u << 0)
#define RESET_BUSCTRL (1u << 1)
#define RESET_DMA (1u << 2)
#define RESET_IO_BANK0 (1u << 5)
#define RESET_PADS_BANK0 (1u << 8)
#define RESET_PIO0 (1u << 10)
#define RESET_PLL_SYS (1u << 12)
#define RESET_PLL_USB (1u << 13)
#define RESET_TIMER (1u << 21)
#define RESET_USB (1u << 24)
#define PSM_WDSEL 0x40010008u
#define PSM_ALL_BUT_CLOCKS 0x1FFFCu

/* 2.8.3 what its own program offers: where the list is; of each function two letters and a place */
#define ROM_FUNCTIONS 0x14u

/* 2.20.2 which chip it is */
#define CHIP_ID 0x40000000u
#define OLDER_THAN_B2 (REGISTER(CHIP_ID) >> 28 < 2) /* B0 or B1, of which E5 tells */

/* 2.12.7 why the chip started */
#define CHIP_RESET 0x40064008u
#define CHIP_RESET_PIN (1u << 16)

/* 2.1.5 the bus: whose turn it is when several meet */
#define BUS_PRIORITY 0x40030000u
#define BUS_DMA_READS (1u << 8)
#define BUS_DMA_WRITES (1u << 12)

/* 2.15 clocks, 2.16 crystal, 2.18 PLL */
#define CLK_REF_CTRL 0x40008030u
#define CLK_REF_SELECTED 0x40008038u
#define CLK_SYS_CTRL 0x4000803Cu
#define CLK_SYS_SELECTED 0x40008044u
#define CLK_USB_CTRL 0x40008054u
#define CLK_ADC_CTRL 0x40008060u
#define CLK_ENABLE (1u << 11)
#define XOSC_CTRL 0x40024000u
#define XOSC_STATUS 0x40024004u
#define XOSC_STARTUP 0x4002400Cu
#define PLL_SYS 0x40028000u
#define PLL_USB 0x4002C000u

/* 2.19 pins */
#define PINS_CTRL(pin) (0x40014004u + 8u * (pin))
#define FUNCTION_SIO 5u
#define FUNCTION_PIO0 6u
#define PADS(pin) (0x4001C004u + 4u * (pin))
#define PAD_SCHMITT (1u << 1)
#define PAD_PULL_DOWN (1u << 2)
#define PAD_PULL_UP (1u << 3)
#define PAD_4MA (1u << 4)
#define PAD_INPUT (1u << 6)
#define PAD_NO_OUTPUT (1u << 7)
#define SIO_IN 0xD0000004u
#define SIO_OUT_SET 0xD0000014u
#define SIO_OUT_CLEAR 0xD0000018u
#define SIO_OE_SET 0xD0000024u

/* 2.5 DMA */
#define DMA_READ(channel) (0x50000000u + 0x40u * (channel))
#define DMA_WRITE(channel) (0x50000004u + 0x40u * (channel))
#define DMA_COUNT(channel) (0x50000008u + 0x40u * (channel))
#define DMA_CTRL(channel) (0x5000000Cu + 0x40u * (channel))
#define DMA_ABORT 0x50000444u
#define DMA_FOR_EVER 0xFFFFFFFFu
#define DMA_ON (1u << 0)
#define DMA_FIRST (1u << 1)
#define DMA_WORDS (2u << 2)
#define DMA_TO_RING(bits) (1u << 5 | (bits) << 6 | 1u << 10)
#define DMA_CHAIN_TO(channel) ((channel) << 11)
#define DMA_PACED_BY_RX(machine) ((4u + (machine)) << 15)
#define DMA_SILENT (1u << 21)

/* 3 PIO */
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

/* 4.6 timer, 4.7 watchdog */
#define TIMER_RAW_LOW 0x40054028u
#define TIMER_ALARM0 0x40054010u
#define TIMER_INTR 0x40054034u
#define TIMER_INTE 0x40054038u
#define WATCHDOG_CTRL 0x40058000u
#define WATCHDOG_LOAD 0x40058004u
#define WATCHDOG_REASON 0x40058008u
#define WATCHDOG_TICK 0x4005802Cu
#define WATCHDOG_COUNTS 2u /* of a microsecond: it counts twice as fast as it says (E1) */

/* 4.9 ADC */
#define ADC_CS 0x4004C000u
#define ADC_RESULT 0x4004C004u
#define ADC_ON (1u << 0)
#define ADC_START (1u << 2)
#define ADC_READY (1u << 8)
#define ADC_CHANNEL(n) ((n) << 12)

/* 4.10 the flash's interface */
#define SSI_CTRLR0 0x18000000u
#define SSI_SSIENR 0x18000008u
#define SSI_SR 0x18000028u
#define SSI_DR0 0x18000060u
#define QSPI_SELECT 0x4001800Cu

/* 4.1 USB */
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
#define INTERRUPT_USB 5u

#endif
