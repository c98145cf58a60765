/* The drop the device holds: what its certificate says, kept where a reset does not clear it. */
#ifndef DROP_H
#define DROP_H

#include <stdbool.h>
#include <stdint.h>

struct drop {
    uint32_t label; /* 0: none */
    uint32_t fire_tick, sense_tick, crc32;
    uint16_t gates, events, overflows, glitches, late;
    uint8_t sensed, pulse_end, restarts;
    uint32_t pulse_ticks;
    uint16_t supply_mv, lowest_mv;
};

extern struct drop drop;

/* The drop is complete: let it outlive a reset. */
void drop_seal(void);

/* There is no drop any more. */
void drop_forget(void);

/* After a reset: take up a sealed drop if all its events are there, else have none. */
bool drop_recover(void);

/* Send its CERTIFICATE as the answer to `ack`. */
void drop_certify(uint8_t ack);

#endif
