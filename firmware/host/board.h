/* A board of plain C: the core on the host, in a virtual time of 16 MHz ticks.
 *
 * It models what of an AVR board decides what the core sees: pin-change flags of two ports, an
 * interrupt with entry and length, a line with a rate, and turns of the main loop that take time.
 */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define BOARD_HZ 16000000u
#ifndef BOARD_STREAMS
#define BOARD_STREAMS 0
#endif
#define BOARD_CAPACITY (BOARD_STREAMS ? 192 : 1024)
#define BOARD_GATES 16
#define BOARD_GATE_MASK 0xFFFFu
#define BOARD_RELEASES 2
#define BOARD_LATENCY HOST_LATENCY
#define BOARD_BUSY (HOST_BUSY + HOST_LATENCY)
#define BOARD_LATE 256
#define BOARD_REACH 0xF800
#define BOARD_SHORT (10 * (BOARD_HZ / 1000000u))
#define BOARD_BYTES_WAIT 0
#define BOARD_STEPS 1
#define BOARD_FLASH
#define BOARD_KEPT __attribute__((section("kept")))

#define HOST_LATENCY 10 /* from an edge to its stamp */
#define HOST_BUSY 36    /* from its stamp to the interrupt's end */
#define HOST_TURN 200   /* how long a turn of the main loop takes */
#define HOST_BYTE 320   /* how long a byte on the line takes: 500 kbaud */

static const char board_type[] = "host";
static const char board_channels[] = "B0 B1 B2 B3 B4 B5 B6 B7 K0 K1 K2 K3 K4 K5 K6 K7";

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

uint16_t board_count(void);
uint16_t board_count_roughly(void);
void board_publish_half(uint8_t half);
uint16_t board_gates(void);
void board_watch(uint16_t gates);
uint8_t *board_entries_end(void);
bool board_has_entry(const uint8_t *entry);
void board_entries_start(uint8_t *memory, uint8_t *stop);
bool board_entries_rewind(const uint8_t *from, uint8_t *to);
void board_entries_stop(uint8_t *slot);
uint16_t board_entries_lost(void);
void board_resume(void);
void board_sync(bool on);
uint16_t board_fire(uint8_t release, uint32_t ticks);
void board_release_end(uint16_t count);
void board_release_off(void);
bool board_release_high(void);
uint32_t board_release_cut(void);
uint16_t board_supply(void);
uint16_t board_supply_mv(uint16_t measured);
bool board_stopped(void);
bool board_reference(uint16_t *count);
void board_sense_begin(void);
bool board_sensed(uint16_t *count);
bool board_receive(uint8_t *byte);
uint8_t board_send(const uint8_t *bytes, uint8_t count);
void board_led(bool on);
void board_kick(void);
void board_name(uint8_t record[]);
void board_rename(const uint8_t record[]);

#endif
