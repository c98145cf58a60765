/* The memory of a drop: what the gates' interrupt stamped, made into events in its own place.
 *
 * The interrupt writes six bytes an entry: count (2), published half (1), which port's change
 * woke it (1), both ports (2). The main loop turns each into an event of the wire: tick (4),
 * gates (2). An entry that only repeats what an earlier one has seen leaves no event, so events
 * are never ahead of entries. A board that STREAMS uses its memory as a ring. */
#ifndef EVENTS_H
#define EVENTS_H

#include <stdbool.h>
#include <stdint.h>

#include "board_api.h"

#define EVENT_SIZE 6
#define EVENTS_BYTES ((uint16_t)BOARD_CAPACITY * EVENT_SIZE)

extern uint8_t events_memory[];

struct events {
    uint16_t count, glitches, late;
    uint32_t crc; /* CRC-32 register, not yet inverted */
    uint16_t sent;
    const uint8_t *unsent; /* where event number `sent` is */
};

extern struct events events;

/* Begin anew, watching these gates. */
void events_start(uint16_t gates);

/* Turn one entry into an event, if there is an entry: whether there was. */
bool events_pass(void);

/* Whether every entry has been turned; exact once the gates are not watched any more. */
bool events_settled(void);

/* While nothing is recorded: which gates moved since the last call (bit 15 of no gate, but a
 * pulse too short to be seen, sets `flicker`). Entries are thrown away. */
uint16_t events_moved(bool *flicker);

/* The event at `events.unsent` is sent. */
void events_sent_one(void);

/* First event that can still be read. */
uint16_t events_first_kept(void);

/* Where event number `index` is. */
const uint8_t *events_at(uint16_t index);

/* A board that streams may use the memory of what is sent again. */
void events_free_sent(void);

/* CRC-32 over `count` events from the beginning of the memory. */
uint32_t events_crc(uint16_t count);

#endif
