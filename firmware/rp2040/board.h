/* Raspberry Pi Pico: sixteen gates, two releases, release sense, 1 Hz reference.
 *
 * A state machine of PIO stamps the gates and hands stamps over by DMA; another ends the pulse of
 * the release by itself. A tick is six clocks of the crystal's 120 MHz: one turn of their loops. */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stdint.h>

#define CLOCK_HZ 120000000u
#define TICK_CLOCKS 6u
#define BOARD_HZ (CLOCK_HZ / TICK_CLOCKS)
#define BOARD_CAPACITY 16384
#define BOARD_STREAMS 0
#define BOARD_GATES 16
#define BOARD_GATE_MASK 0xFFFFu
#define BOARD_RELEASES 2
/* An edge is sampled up to a tick after it came, and two clocks later in the pins' synchronisers. */
#define BOARD_LATENCY 1
#define BOARD_BUSY 0
/* For three ticks after an event no gate is looked at: what changes then is stamped at their end. */
#define BOARD_LATE 4
#define BOARD_REACH UINT32_MAX
#define BOARD_SHORT 1
#define BOARD_BYTES_WAIT 1
#define BOARD_STEPS 6
#define BOARD_BOOTS
#define BOARD_FLASH
#define BOARD_KEPT __attribute__((section(".kept")))

/* GP0 to GP15 are the gates. The rest is numbered as the pins are. */
#define RELEASE_0 16
#define RELEASE_1 17
#define SYNC 18
#define STOP 19 /* closed to ground when all is well */
#define SENSE 20
#define REFERENCE 21
#define LED 25  /* on the board */
#define SUPPLY 29 /* the supply before the regulator, through a divider of three */

#ifndef BOARD_SUFFIX
#define BOARD_SUFFIX ""
#endif
static const char board_type[] = "Raspberry Pi Pico" BOARD_SUFFIX;
static const char board_channels[] =
    "GP0 GP1 GP2 GP3 GP4 GP5 GP6 GP7 GP8 GP9 GP10 GP11 GP12 GP13 GP14 GP15";

static inline uint8_t board_flash8(const void *at)
{
    return *(const uint8_t *)at;
}

static inline uint32_t board_flash32(const void *at)
{
    return *(const uint32_t *)at;
}

static inline uint16_t board_gates_of(uint8_t port_0, uint8_t port_1)
{
    return (uint16_t)(port_0 | port_1 << 8);
}

static inline uint16_t board_ports_of(uint16_t gates)
{
    return gates;
}

/* Entries have all bits of their time. */
static inline void board_publish_half(uint8_t half)
{
    (void)half;
}

/* The pulse is never longer than hardware reaches. */
static inline void board_release_end(uint16_t count)
{
    (void)count;
}

/* Nothing is ever switched off for want of memory. */
static inline void board_resume(void)
{
}

uint16_t board_count(void);
uint16_t board_count_roughly(void);
uint16_t board_gates(void);
void board_watch(uint16_t gates);
uint8_t *board_entries_end(void);
bool board_has_entry(const uint8_t *entry);
void board_entries_start(uint8_t *memory, uint8_t *stop);
bool board_entries_rewind(const uint8_t *from, uint8_t *to);
void board_entries_stop(uint8_t *slot);
uint16_t board_entries_lost(void);
uint16_t board_fire(uint8_t release, uint32_t ticks);
void board_release_off(void);
bool board_release_high(void);
uint32_t board_release_cut(void);
void board_sync(bool on);
bool board_stopped(void);
bool board_reference(uint16_t *count);
void board_sense_begin(void);
bool board_sensed(uint16_t *count);
uint16_t board_supply(void);
uint16_t board_supply_mv(uint16_t measured);
bool board_receive(uint8_t *byte);
uint8_t board_send(const uint8_t *bytes, uint8_t count);
void board_led(bool on);
void board_kick(void);
void board_name(uint8_t record[]);
void board_boot(void);
void board_rename(const uint8_t record[]);

#endif
