/* The whole core against any bytes: a target for libFuzzer, or with -DREAD_STDIN a program that
 * takes length-prefixed inputs (u32, little-endian) from standard input and prints for each how
 * often the release went on.
 *
 * An input is a script: bytes on the line, frames with a right CRC around any content, FIRE and
 * ACKNOWLEDGE with what the device has said, gates that move, time that passes, resets, the
 * emergency stop. Whatever it says, the release may be on only during a recording that FIRE began,
 * not longer than its bound, and never while stopped. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "board.h"
#include "checks.h"
#include "host.h"
#include "release.h"
#include "wire.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static uint64_t now, on_since;
static bool open_stop;
static uint8_t token[4], held[8]; /* of ARMED; label and CRC of the latest certificate */
static unsigned pulses; /* how often the release went on */

#define LONGEST ((uint64_t)RELEASE_MAX_US * 16 + 20 * HOST_TURN)

static void check(void)
{
    bool on = host_outputs() != 0;
    if (!on)
        on_since = 0;
    else if (on_since == 0)
        on_since = now, pulses++;
    if (on && (now - on_since > LONGEST || open_stop))
        abort();
}

/* The frame that ends now, if it is ARMED or a certificate: without what it says nothing could be
 * fired, or given up. */
static void listen(uint8_t byte)
{
    static uint8_t raw[256], size;
    uint8_t body[256], n, at = 0, next;
    raw[size++] = byte;
    if (byte)
        return;
    for (n = 0, next = raw[0]; n + 1 < size; n++)
        if (n == next)
            next = (uint8_t)(next + raw[n]), body[at++] = 0;
        else if (n)
            body[at++] = raw[n];
    size = 0;
    if (at >= 7 && body[0] == MSG_ARMED)
        for (n = 0; n < 4; n++)
            token[n] = body[3 + n];
    if (at >= 3 + DROP_CERTIFICATE2_OVERFLOWS && body[0] == MSG_DROP_CERTIFICATE2)
        for (n = 0; n < 4; n++)
            held[n] = body[3 + n], held[4 + n] = body[3 + DROP_CERTIFICATE2_CRC32 + n];
}

static void run(uint64_t ticks)
{
    uint64_t until = now + ticks, when;
    int byte;
    while (now + HOST_TURN <= until) {
        uint64_t step = until - now > 3200 ? 3200 : until - now;
        now = host_run(now + step);
        check();
        while ((byte = host_take(&when)) >= 0)
            listen((uint8_t)byte);
    }
}

static void feed(uint8_t byte)
{
    if (!host_feed(now, byte))
        run(1000000);
}

/* A frame as the host would send it. */
static void frame(const uint8_t *body, uint8_t size)
{
    uint8_t whole[64], n, code_at = 0, stuffed[70], end = 1;
    uint16_t crc = CRC16_START;
    for (n = 0; n < size; n++) {
        whole[n] = body[n];
        crc = crc16_add(crc, body[n]);
    }
    whole[size] = (uint8_t)crc;
    whole[size + 1] = (uint8_t)(crc >> 8);
    for (n = 0; n < size + 2; n++) {
        if (whole[n] == 0) {
            stuffed[code_at] = (uint8_t)(end - code_at);
            code_at = end++;
        } else {
            stuffed[end++] = whole[n];
        }
    }
    stuffed[code_at] = (uint8_t)(end - code_at);
    for (n = 0; n < end; n++)
        feed(stuffed[n]);
    feed(0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const uint8_t *end = data + size;
    host_power(0xFFFFFF00u);
    now = 1;
    on_since = pulses = 0;
    open_stop = false;
    while (end - data >= 2) {
        uint8_t what = data[0] & 7, amount = data[0] >> 3, value = data[1];
        data += 2;
        if (what < 2 && amount > end - data)
            amount = (uint8_t)(end - data);
        switch (what) {
        case 0:
            while (amount--)
                feed(*data++);
            break;
        case 2: {
            uint8_t body[11] = {amount ? MSG_ACKNOWLEDGE : MSG_FIRE, value};
            memcpy(body + 3, amount ? held : token, amount ? sizeof held : sizeof token);
            frame(body, amount ? 11 : 7);
            run(20000);
            break;
        }
        case 1:
            frame(data, amount);
            data += amount;
            break;
        case 3:
            run((uint64_t)value << amount % 16);
            break;
        case 4:
            if (host_change(now + value, amount % BOARD_GATES, amount >> 4))
                run(value * 16u);
            break;
        case 5:
            host_stop(value & 1);
            open_stop = false; /* the device may take some turns to see it */
            run(64 * HOST_TURN);
            open_stop = value & 1;
            break;
        case 6:
            host_reference(now + value);
            host_sense(value);
            break;
        default:
            if (value < 16)
                host_reset(value);
            else
                run(320u * value);
        }
        check();
    }
    run(20000);
    return 0;
}

#ifdef READ_STDIN
int main(void)
{
    uint8_t length[4], *data = malloc(1 << 16);
    while (data && fread(length, 1, sizeof length, stdin) == sizeof length) {
        size_t size = (size_t)(length[0] | length[1] << 8);
        if (fread(data, 1, size, stdin) != size)
            break;
        LLVMFuzzerTestOneInput(data, size);
        printf("%u\n", pulses);
        fflush(stdout);
    }
    free(data);
    return 0;
}
#endif
