#include "drop.h"

#include "board_api.h"
#include "checks.h"
#include "events.h"
#include "send.h"
#include "wire.h"

struct drop drop BOARD_KEPT;
static uint16_t seal BOARD_KEPT; /* CRC-16 over `drop` while it is complete */

static uint16_t check(void)
{
    const uint8_t *byte = (const uint8_t *)&drop;
    uint16_t crc = CRC16_START;
    uint8_t n;
    for (n = 0; n < sizeof drop; n++)
        crc = crc16_add(crc, byte[n]);
    return crc;
}

void drop_seal(void)
{
    seal = check();
}

void drop_forget(void)
{
    drop.label = 0;
    seal = (uint16_t)~check();
}

bool drop_recover(void)
{
    if (seal == check() && drop.label && drop.events <= BOARD_CAPACITY - BOARD_STREAMS &&
        events_crc(drop.events) == drop.crc32) {
        events.count = events.sent = drop.events;
        return true;
    }
    drop_forget();
    return false;
}

void drop_certify(uint8_t ack)
{
    send_begin(MSG_DROP_CERTIFICATE2, ack);
    send32(drop.label);
    send32(drop.fire_tick);
    send16(drop.gates);
    send16(0); /* the gates that count were clear, or FIRE had been refused */
    send16(drop.events);
    send32(drop.crc32);
    send16(drop.overflows);
    send16(drop.glitches);
    send16(drop.late);
    send8(drop.sensed);
    send32(drop.sense_tick);
    send32(drop.pulse_ticks);
    send8(drop.pulse_end);
    send8(drop.restarts);
    send16(drop.supply_mv);
    send16(drop.lowest_mv);
    send_end();
}
