/* The registers that this firmware uses. Where blocks are, and what else differs from chip to chip, is
 * in the chip's `blocks.h`; section numbers in brackets are those of the RP2040's data sheet. */
#ifndef REGISTERS_H
#define REGISTERS_H

#include <stdint.h>

#define REGISTER(address) (*(volatile uint32_t *)(address))
/* The same register, where a write sets or clears the bits that it has (2.1.2). */
#define TO_SET(address) REGISTER((address) + 0x2000u)
#define TO_CLEAR(address) REGISTER((address) + 0x3000u)

#include "blocks.h"

/* Resets (2.14), and what the watchdog resets (2.13) */
#define RESETS_RESET RESETS
#define RESETS_DONE (RESETS + 8u)
#define RESET_ADC (1u << 0)
#define RESET_BUSCTRL (1u << 1)
#define RESET_DMA (1u << 2)
#define PSM_WDSEL (PSM + 8u)

/* The bus: whose turn it is when several meet (2.1.5) */
#define BUS_DMA_READS (1u << 8)
#define BUS_DMA_WRITES (1u << 12)

/* Clocks (2.15), crystal (2.16) */
#define CLK_REF_CTRL (CLOCKS + 0x30u)
#define CLK_REF_SELECTED (CLOCKS + 0x38u)
#define CLK_SYS_CTRL (CLOCKS + 0x3Cu)
#define CLK_SYS_SELECTED (CLOCKS + 0x44u)
#define CLK_ENABLE (1u << 11)
#define XOSC_CTRL XOSC
#define XOSC_STATUS (XOSC + 4u)
#define XOSC_STARTUP (XOSC + 12u)

/* Pins (2.19) */
#define PINS_CTRL(pin) (IO_BANK0 + 4u + 8u * (pin))
#define FUNCTION_SIO 5u
#define FUNCTION_PIO0 6u
#define PADS(pin) (PADS_BANK0 + 4u + 4u * (pin))
#define PAD_SCHMITT (1u << 1)
#define PAD_PULL_DOWN (1u << 2) /* of outputs alone: by RP2350-E9 such an input may stay at 2 V */
#define PAD_PULL_UP (1u << 3)
#define PAD_4MA (1u << 4)
#define PAD_INPUT (1u << 6)
#define PAD_NO_OUTPUT (1u << 7)
#define SIO_IN 0xD0000004u

/* DMA (2.5) */
#define DMA_READ(channel) (0x50000000u + 0x40u * (channel))
#define DMA_WRITE(channel) (0x50000004u + 0x40u * (channel))
#define DMA_COUNT(channel) (0x50000008u + 0x40u * (channel))
#define DMA_CTRL(channel) (0x5000000Cu + 0x40u * (channel))
#define DMA_ON (1u << 0)
#define DMA_FIRST (1u << 1)
#define DMA_WORDS (2u << 2)

/* PIO (3) */
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

/* Timer (4.6), watchdog (4.7) */
#define TIMER_ALARM0 (TIMER + 0x10u)
#define TIMER_RAW_LOW (TIMER + 0x28u)
#define WATCHDOG_CTRL WATCHDOG
#define WATCHDOG_LOAD (WATCHDOG + 4u)
#define WATCHDOG_REASON (WATCHDOG + 8u)

/* ADC (4.9) */
#define ADC_CS ADC
#define ADC_RESULT (ADC + 4u)
#define ADC_ON (1u << 0)
#define ADC_START (1u << 2)
#define ADC_READY (1u << 8)
#define ADC_CHANNEL(n) ((n) << 12)

/* USB (4.1) */
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

#endif
