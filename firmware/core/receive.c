#include "receive.h"

#include "checks.h"
#include "wire.h"

#define HEAD 3  /* type, seq, ack */
#define CHECK 2 /* the CRC behind the payload */

#define TAKEN 64 /* a power of two */

static uint8_t taken[TAKEN], taken_first, taken_end;

static struct {
    uint8_t stuffed; /* bytes since the last delimiter */
    uint8_t code;    /* of the COBS block we are in */
    uint8_t left;    /* bytes of that block still to come */
    uint8_t size;    /* bytes of the frame itself */
    uint8_t last[CHECK];
    uint16_t crc; /* over all but the last two */
    bool hopeless;
} in;

static void begin(void)
{
    in.stuffed = in.left = in.size = 0;
    in.code = 0xFF;
    in.crc = CRC16_START;
    in.hopeless = false;
}

void receive_reset(void)
{
    taken_first = taken_end = 0;
    begin();
}

void receive_take(uint8_t byte)
{
    if (receive_has_room())
        taken[taken_end++ % TAKEN] = byte;
}

bool receive_has_room(void)
{
    return (uint8_t)(taken_end - taken_first) < TAKEN;
}

bool receive_idle(void)
{
    return taken_first == taken_end;
}

static void unstuffed(uint8_t byte, struct request *request)
{
    if (in.size >= CHECK) {
        uint8_t index = (uint8_t)(in.size - CHECK);
        uint8_t sure = in.last[0];
        in.crc = crc16_add(in.crc, sure);
        if (index == 0)
            request->type = sure;
        else if (index == 1)
            request->seq = sure;
        else if (index >= HEAD && index < HEAD + RECEIVE_KEPT)
            request->payload[index - HEAD] = sure;
    }
    in.last[0] = in.last[1];
    in.last[1] = byte;
    in.size++;
}

static bool complete(struct request *request)
{
    uint16_t check = (uint16_t)(in.last[0] | (uint16_t)in.last[1] << 8);
    bool good = !in.hopeless && in.left == 0 && in.size >= HEAD + CHECK && check == in.crc;
    request->crc = in.crc;
    request->size = (uint8_t)(in.size - HEAD - CHECK);
    begin();
    return good;
}

static bool read_byte(uint8_t byte, struct request *request)
{
    if (byte == 0)
        return complete(request);
    if (++in.stuffed == FRAME_LIMIT) {
        in.stuffed--;
        in.hopeless = true;
    }
    if (in.left == 0) {
        if (in.code != 0xFF)
            unstuffed(0, request);
        in.code = byte;
        in.left = (uint8_t)(byte - 1);
    } else {
        in.left--;
        unstuffed(byte, request);
    }
    return false;
}

bool receive_request(struct request *request)
{
    receive_pass();
    return taken_first != taken_end && read_byte(taken[taken_first++ % TAKEN], request);
}
