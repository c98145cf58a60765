/* What both AVR boards share of the core's board interface; each board's own `board.h` names its
 * timer, ports and pins, and then includes this. */
#ifndef BOARD_AVR_H
#define BOARD_AVR_H

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/wdt.h>
#include <stdbool.h>
#include <stdint.h>
#include <util/atomic.h>

#define BOARD_HZ F_CPU
#define BOARD_BYTES_WAIT 0
#define BOARD_STEPS 1
#define BOARD_FLASH PROGMEM
/* A stamp may be off when the interrupt before it was still running: three passes through the
 * interrupt, with room to spare. */
#define BOARD_LATE 256
/* A turn of the compare unit's counter, less what a look at it may be off. */
#define BOARD_REACH 0xF800
/* A match that is set for so soon may have been passed before it was set. */
#define BOARD_SHORT (10 * (BOARD_HZ / 1000000u))
#define BOARD_KEPT __attribute__((section(".noinit")))

/* The stamp interrupt (stamp.S) has registers of its own, which the compiler is told to leave alone
 * (-ffixed-r2 to -ffixed-r13): saving none makes it half as long. Pairs are read and written by one
 * movw, so no interrupt can come between their halves. */
extern volatile uint16_t entries_lost;

static inline uint8_t board_flash8(const void *at)
{
    return pgm_read_byte(at);
}

static inline uint32_t board_flash32(const void *at)
{
    return pgm_read_dword(at);
}

/* The counter's two bytes go through one hidden register that the interrupt uses too. */
static inline uint16_t board_count(void)
{
    uint16_t count;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        count = BOARD_COUNTER;
    }
    return count;
}

/* Without holding interrupts off: when one comes in between, the high byte is the later one's. */
static inline uint16_t board_count_roughly(void)
{
    return BOARD_COUNTER;
}

static inline void board_publish_half(uint8_t half)
{
    GPIOR0 = half;
}

/* Where the interrupt will write its next entry. */
static inline uint8_t *board_entries_end(void)
{
    uint8_t *end;
    __asm__ volatile("movw %0, r10" : "=r"(end));
    return end;
}

static inline void entries_set(uint8_t *to)
{
    __asm__ volatile("movw r10, %0" : : "r"(to));
}

/* Where it must not write any more. */
static inline void board_entries_stop(uint8_t *slot)
{
    __asm__ volatile("movw r12, %0" : : "r"(slot));
}

static inline bool board_has_entry(const uint8_t *entry)
{
    return board_entries_end() != entry;
}

static inline void board_entries_start(uint8_t *memory, uint8_t *stop)
{
    __asm__ volatile("clr r6\n\tclr r7\n\tinc r7"); /* the names of the two ports */
    entries_lost = 0;
    board_entries_stop(stop);
    entries_set(memory);
}

/* Give memory back, unless an entry has come meanwhile. */
static inline bool board_entries_rewind(const uint8_t *from, uint8_t *to)
{
    bool rewound = false;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        if (board_entries_end() == from) {
            entries_set(to);
            rewound = true;
        }
    }
    return rewound;
}

static inline uint16_t board_entries_lost(void)
{
    uint16_t lost;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        lost = entries_lost;
    }
    return lost;
}

/* Interrupts that the memory's end has switched off. */
static inline void board_resume(void)
{
    PCICR = BOARD_INTERRUPTS;
}

static inline void board_sync(bool on)
{
    if (on)
        RELEASE_PORT |= SYNC;
    else
        RELEASE_PORT &= (uint8_t)~SYNC;
}

/* The releases are driven by two compare units of one timer; the port's bits stay 0. Connected to
 * its unit a pin shows the register OCnx: that is 0, but from a forced match of `board_fire` to the
 * match that ends the pulse, or a forced one. */
static inline uint8_t units(uint8_t release, uint8_t unit_0, uint8_t unit_1)
{
    return (uint8_t)((release & 1 ? unit_0 : 0) | (release & 2 ? unit_1 : 0));
}

static inline void release_match(uint16_t count)
{
    RELEASE_MATCH_0 = RELEASE_MATCH_1 = count;
}

/* End the pulse when the counter gets there. */
static inline void board_release_end(uint16_t count)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        release_match((uint16_t)(count + release_offset - 1)); /* a clock after they are equal */
    }
}

static inline uint16_t board_fire(uint8_t release, uint32_t ticks)
{
    uint8_t set = units(release, RELEASE_SET_0, RELEASE_SET_1);
    uint8_t clear = units(release, RELEASE_CLEAR_0, RELEASE_CLEAR_1);
    uint8_t force = RELEASE_FORCE_BOTH;
    uint16_t count;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        release_match((uint16_t)(RELEASE_COUNTER - 1)); /* no match for a whole turn */
        RELEASE_UNITS = set;
        __asm__ volatile("" : "+r"(force)); /* in its register, so that these are two instructions */
        RELEASE_PORT |= SYNC;
        RELEASE_FORCE = force;
        count = BOARD_COUNTER;
    }
    RELEASE_UNITS = clear;
    count = (uint16_t)(count - 2); /* it was read two cycles after the match */
    board_release_end((uint16_t)(count + ticks));
    return count;
}

static inline void board_release_off(void)
{
    RELEASE_FORCE = RELEASE_FORCE_BOTH;
    RELEASE_UNITS = 0;
}

/* The emergency stop is the program's work here. */
static inline uint32_t board_release_cut(void)
{
    return 0;
}

/* The pins themselves. */
static inline bool board_release_high(void)
{
    return RELEASE_PIN & (RELEASE_0 | RELEASE_1);
}

static inline bool board_stopped(void)
{
    return STOP_PORT & STOP;
}

static inline void board_led(bool on)
{
    if (on)
        LED_PORT |= LED;
    else
        LED_PORT &= (uint8_t)~LED;
}

/* What an input-capture pin has caught, if its flag says so. */
static inline bool caught(volatile uint8_t *flags, uint8_t flag, volatile uint16_t *capture,
                          uint16_t *count)
{
    if (!(*flags & flag))
        return false;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        *count = *capture;
    }
    *flags = flag;
    return true;
}

/* The reference voltage, measured against the supply, over and over: 0 if there is nothing new. */
static inline uint16_t board_supply(void)
{
    uint16_t measured;
    if (!(ADCSRA & _BV(ADIF)))
        return 0;
    measured = ADC;
    ADCSRA |= _BV(ADIF);
    return measured;
}

#define REFERENCE_MV 1100u /* 1.0 to 1.2 V from one controller to the next */

static inline uint16_t board_supply_mv(uint16_t measured)
{
    return measured ? (uint16_t)(REFERENCE_MV * 1024ul / measured) : 0;
}

/* The line is polled: an interrupt for each byte would be one more that can delay a stamp. */
static inline bool board_receive(uint8_t *byte)
{
    if (!(UCSR0A & _BV(RXC0)))
        return false;
    *byte = UDR0;
    return true;
}

static inline uint8_t board_send(const uint8_t *bytes, uint8_t count)
{
    if (!count || !(UCSR0A & _BV(UDRE0)))
        return 0;
    UDR0 = *bytes;
    return 1;
}

static inline void board_kick(void)
{
    wdt_reset();
}

/* The record of `name.h` in EEPROM, where neither reset nor flashing changes it. */
void board_name(uint8_t record[]);
void board_rename(const uint8_t record[]);

/* MCUSR as the reset left it; the boot loader may have cleared it. */
extern uint8_t reset_cause;

#endif
