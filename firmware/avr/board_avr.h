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
#define BOARD_FLASH PROGMEM
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

/* The outputs, all on one port, from the board's names of its pins. */
static inline uint8_t outputs(uint8_t release, bool sync)
{
    uint8_t bits = sync ? SYNC : 0;
    if (release & 1)
        bits |= RELEASE_0;
    if (release & 2)
        bits |= RELEASE_1;
    return bits;
}

static inline void board_outputs(uint8_t release, bool sync)
{
    RELEASE_PORT = (uint8_t)((RELEASE_PORT & (uint8_t)~(RELEASE_0 | RELEASE_1 | SYNC)) |
                             outputs(release, sync));
}

static inline uint16_t board_fire(uint8_t release)
{
    uint8_t port = (uint8_t)(RELEASE_PORT | outputs(release, true));
    uint16_t count;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        RELEASE_PORT = port;
        count = BOARD_COUNTER;
    }
    return count;
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

/* The line is polled: an interrupt for each byte would be one more that can delay a stamp. */
static inline bool board_receive(uint8_t *byte)
{
    if (!(UCSR0A & _BV(RXC0)))
        return false;
    *byte = UDR0;
    return true;
}

static inline bool board_send_ready(void)
{
    return UCSR0A & _BV(UDRE0);
}

static inline void board_send(uint8_t byte)
{
    UDR0 = byte;
}

static inline void board_kick(void)
{
    wdt_reset();
}

/* Eight bytes in EEPROM, where neither reset nor flashing changes them. */
void board_name(uint8_t name[8]);
void board_rename(const uint8_t name[8]);

/* MCUSR as the reset left it; the boot loader may have cleared it. */
extern uint8_t reset_cause;

#endif
