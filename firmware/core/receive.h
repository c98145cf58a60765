/* Bytes from the host -> requests. */
#ifndef RECEIVE_H
#define RECEIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "board_api.h"

#define RECEIVE_KEPT 16 /* payload bytes kept: no request of the table has more */

struct request {
    uint8_t type, seq;
    uint8_t size; /* of the whole payload, also where it was too long to be kept */
    uint16_t crc;
    uint8_t payload[RECEIVE_KEPT];
};

/* Forget everything received so far. */
void receive_reset(void);

/* Keep a byte until it is read; with 64 waiting, the next ones are lost. */
void receive_take(uint8_t byte);

/* Whether another one could be kept, and whether none is. */
bool receive_has_room(void);
bool receive_idle(void);

/* Take what is on the line: an AVR's keeps only two bytes, so this is called from wherever much is
 * done. */
static inline void receive_pass(void)
{
    uint8_t byte;
    while ((!BOARD_BYTES_WAIT || receive_has_room()) && board_receive(&byte))
        receive_take(byte);
}

/* Read what was taken, up to the end of a frame whose length, COBS and CRC are right: true then. */
bool receive_request(struct request *request);

#endif
