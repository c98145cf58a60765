/* A device of one's own, written from PROTOCOL.md alone: behind a pseudo-terminal, whose path it
 * prints. Three rods fall through its two gates at every FIRE.
 *
 *     cc -o device device.c frames.c && ./device
 *     rig selftest --port /dev/pts/N
 */
#define _XOPEN_SOURCE 700

#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "frames.h"

enum { IDENTIFY = 1, PING, STATUS, ARM, FIRE, ABORT, READ, ACKNOWLEDGE, REFERENCE };
enum {
    IDENTITY = 0x81, PONG, STATE, ARMED, FIRED, REFUSED, DONE, EVENTS,
    DISARMED = 0x8A, BOOT, REFERENCE_PULSE, DROP_CERTIFICATE2
};
enum { IDLE, IS_ARMED, RECORDING, HOLDING };
enum {
    NOT_ARMED = 1, WRONG_TOKEN, GATE_BLOCKED, GATE_UNSTEADY, BAD_PARAMETER, BUSY, HOLDING_A_DROP,
    NO_SUCH_DROP, WRONG_CRC, VERSION, UNKNOWN_MESSAGE, STOPPED, COOLING
};

#define PROTOCOL 2
#define TICKS_PER_MS 1000u
#define GATES 2
#define RELEASES 1
#define MAX_PULSE_US 500000
#define EVENT_SIZE 6
#define CAPACITY 128
#define BATCH 16
#define SILENCE_MS 250
#define TIMEOUT 1
#define HOST_SILENT 2
#define RESTARTED 128
#define REST 3 /* times as long as it was on */

static const uint8_t size_of[] = {0, 1, 0, 0, 15, 4, 0, 7, 8, 0}; /* of each request's payload */

/* Rods of 12 ms at 30, 130 and 230 ms, first at gate 0, 40 ms later at gate 1. */
static const struct {
    uint16_t at_ms, state;
} fall[] = {{30, 1},  {42, 0},  {70, 2},  {82, 0},  {130, 1}, {142, 0},
            {170, 2}, {182, 0}, {230, 1}, {242, 0}, {270, 2}, {282, 0}};
#define FALL (sizeof fall / sizeof fall[0])

static int line;
static uint8_t seq, phase, aborted, restarts = RESTARTED;
static uint32_t token = 0x5EED;

static struct {
    uint32_t label, pulse_us, since, timeout_ms, heard;
    uint16_t gates, record_ms;
    uint8_t release;
} order;

static struct {
    uint32_t label, fire_tick, pulse_ticks;
    uint16_t gates, record_ms, count;
    uint8_t events[CAPACITY * EVENT_SIZE], pulse_end;
    bool on;
    uint32_t pulse_us;
    size_t fallen;
} drop;

static uint32_t off_tick, rest_ticks; /* the release rests so long since then */

/* The last request, and what it was answered: a repeat is not executed again. */
static struct {
    uint8_t type, seq;
    uint16_t crc;
    struct frame answer;
} last;

static uint32_t ticks(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint32_t)((uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u);
}

static void send(struct frame *frame)
{
    uint8_t bytes[FRAME_LIMIT];
    size_t count, sent = 0;
    seq = seq % 255 + 1;
    frame->seq = seq;
    count = frame_write(frame, bytes);
    while (sent < count) {
        ssize_t n = write(line, bytes + sent, count - sent);
        if (n <= 0)
            return; /* nobody listens: a serial line would not wait either */
        sent += (size_t)n;
    }
}

static struct frame begin(uint8_t type)
{
    struct frame frame = {.type = type};
    return frame;
}

static void put_text(struct frame *frame, const char *text)
{
    put8(frame, (uint8_t)strlen(text));
    while (*text)
        put8(frame, (uint8_t)*text++);
}

static struct frame refused(uint8_t reason, uint16_t detail)
{
    struct frame frame = begin(REFUSED);
    put8(&frame, reason);
    put16(&frame, detail);
    return frame;
}

static struct frame events(uint16_t first, uint16_t count)
{
    struct frame frame = begin(EVENTS);
    put32(&frame, drop.label);
    put16(&frame, first);
    for (size_t n = 0; n < (size_t)count * EVENT_SIZE; n++)
        put8(&frame, drop.events[(size_t)first * EVENT_SIZE + n]);
    return frame;
}

static struct frame certificate(void)
{
    struct frame frame = begin(DROP_CERTIFICATE2);
    put32(&frame, drop.label);
    put32(&frame, drop.fire_tick);
    put16(&frame, drop.gates);
    put16(&frame, 0); /* the gates at FIRE */
    put16(&frame, drop.count);
    put32(&frame, drop.count ? crc32(drop.events, (size_t)drop.count * EVENT_SIZE) : 0);
    put16(&frame, 0); /* overflows */
    put16(&frame, 0); /* glitches */
    put16(&frame, 0); /* late */
    put8(&frame, 0);  /* sensed */
    put32(&frame, 0);
    put32(&frame, drop.pulse_ticks);
    put8(&frame, drop.pulse_end);
    put8(&frame, restarts);
    put16(&frame, 0); /* the supply is not measured */
    put16(&frame, 0);
    return frame;
}

static void release_off(uint8_t why)
{
    if (!drop.on)
        return;
    drop.on = false;
    off_tick = ticks();
    drop.pulse_ticks = off_tick - drop.fire_tick;
    drop.pulse_end = why;
    rest_ticks = REST * drop.pulse_ticks;
}

static void hold(void)
{
    struct frame frame;
    release_off(0);
    for (uint16_t first = 0; first < drop.count; first = (uint16_t)(first + BATCH)) {
        uint16_t left = (uint16_t)(drop.count - first);
        frame = events(first, left < BATCH ? left : BATCH);
        send(&frame);
    }
    phase = HOLDING;
    frame = certificate();
    send(&frame);
}

static struct frame arm(const uint8_t *asked)
{
    uint32_t label = get32(asked), pulse_us = get32(asked + 7), now = ticks();
    uint16_t gates = get16(asked + 4), timeout_ms = get16(asked + 11), record_ms = get16(asked + 13);
    uint8_t release = asked[6];
    if (phase == RECORDING)
        return refused(BUSY, 0);
    if (phase == HOLDING && !(aborted && drop.label == label))
        return refused(HOLDING_A_DROP, (uint16_t)drop.label);
    if (!label || !gates || gates >> GATES || release >> RELEASES || pulse_us > MAX_PULSE_US ||
        !release != !pulse_us || !timeout_ms || !record_ms)
        return refused(BAD_PARAMETER, 0);
    if (release && now - off_tick < rest_ticks) {
        uint32_t left = rest_ticks - (now - off_tick);
        return refused(COOLING, (uint16_t)((left + TICKS_PER_MS - 1) / TICKS_PER_MS));
    }
    order.label = label;
    order.gates = gates;
    order.release = release;
    order.pulse_us = pulse_us;
    order.timeout_ms = timeout_ms;
    order.record_ms = record_ms;
    order.since = now;
    phase = IS_ARMED;
    token = token * 1664525u + 1013904223u;
    struct frame frame = begin(ARMED);
    put32(&frame, token);
    return frame;
}

static struct frame fire(const uint8_t *asked)
{
    if (phase != IS_ARMED)
        return refused(NOT_ARMED, 0);
    if (get32(asked) != token)
        return refused(WRONG_TOKEN, 0);
    memset(&drop, 0, sizeof drop);
    drop.label = order.label;
    drop.gates = order.gates;
    drop.record_ms = order.record_ms;
    drop.pulse_us = order.pulse_us;
    drop.on = order.release != 0;
    drop.fire_tick = ticks();
    aborted = 0;
    phase = RECORDING;
    struct frame frame = begin(FIRED);
    put32(&frame, drop.fire_tick);
    return frame;
}

static struct frame held(const struct frame *request)
{
    const uint8_t *asked = request->payload;
    struct frame done = begin(DONE);
    if (phase == RECORDING)
        return refused(BUSY, 0);
    if (phase != HOLDING || get32(asked) != drop.label)
        return refused(NO_SUCH_DROP, 0);
    if (request->type == ACKNOWLEDGE) {
        if (get32(asked + 4) != (drop.count ? crc32(drop.events, (size_t)drop.count * EVENT_SIZE) : 0))
            return refused(WRONG_CRC, 0);
        phase = IDLE;
        return done;
    }
    uint16_t first = get16(asked + 4), count = asked[6];
    if (count == 0)
        return certificate();
    if (first >= drop.count)
        return refused(BAD_PARAMETER, 0);
    if (count > BATCH)
        count = BATCH;
    return events(first, count < drop.count - first ? count : (uint16_t)(drop.count - first));
}

static struct frame execute(const struct frame *request)
{
    struct frame frame = begin(DONE);
    if (request->type == 0 || request->type > REFERENCE)
        return refused(UNKNOWN_MESSAGE, request->type);
    if (request->size != size_of[request->type])
        return refused(BAD_PARAMETER, 0);
    switch (request->type) {
    case IDENTIFY:
        if (request->payload[0] != PROTOCOL)
            return refused(VERSION, PROTOCOL);
        restarts = 0;
        frame = begin(IDENTITY);
        put8(&frame, PROTOCOL);
        put_text(&frame, "an example in C");
        put_text(&frame, "example 1");
        for (const char *id = "exampleC"; *id; id++)
            put8(&frame, (uint8_t)*id);
        put32(&frame, 1000 * TICKS_PER_MS);
        put8(&frame, GATES);
        put8(&frame, RELEASES);
        put32(&frame, MAX_PULSE_US);
        put16(&frame, CAPACITY);
        put8(&frame, 0);  /* a drop is kept whole */
        put16(&frame, 0); /* no stamp is late */
        put_text(&frame, "upper lower");
        return frame;
    case PING:
        frame = begin(PONG);
        put32(&frame, ticks());
        return frame;
    case STATUS:
        frame = begin(STATE);
        put8(&frame, phase);
        put16(&frame, 0); /* nothing is in a beam */
        put32(&frame, phase == IDLE ? 0 : phase == IS_ARMED ? order.label : drop.label);
        put16(&frame, phase >= RECORDING ? drop.count : 0);
        return frame;
    case ARM:
        return arm(request->payload);
    case FIRE:
        return fire(request->payload);
    case ABORT:
        if (phase == IS_ARMED)
            phase = IDLE;
        release_off(2);
        aborted = 1;
        return frame;
    case REFERENCE:
        frame = begin(REFERENCE_PULSE);
        put16(&frame, 0);
        put32(&frame, 0);
        return frame;
    default:
        return held(request);
    }
}

static void answer(const struct frame *request)
{
    uint8_t body[3 + PAYLOAD_LIMIT] = {request->type, request->seq, request->ack};
    uint16_t crc;
    if (request->seq == 0)
        return;
    memcpy(body + 3, request->payload, request->size);
    crc = crc16(body, 3 + (size_t)request->size);
    order.heard = ticks();
    if (request->type != last.type || request->seq != last.seq || crc != last.crc) {
        last.type = request->type;
        last.seq = request->seq;
        last.crc = crc;
        last.answer = execute(request);
        last.answer.ack = request->seq;
    }
    send(&last.answer);
    if (phase == RECORDING && aborted)
        hold();
}

static void disarm(uint8_t reason)
{
    struct frame frame = begin(DISARMED);
    put32(&frame, order.label);
    put8(&frame, reason);
    phase = IDLE;
    send(&frame);
}

/* What goes on by itself. */
static void pass(void)
{
    uint32_t now = ticks();
    if (phase == IS_ARMED) {
        if (now - order.since >= order.timeout_ms * TICKS_PER_MS)
            disarm(TIMEOUT);
        else if (now - order.heard >= SILENCE_MS * TICKS_PER_MS)
            disarm(HOST_SILENT);
        return;
    }
    if (phase != RECORDING)
        return;
    if (now - drop.fire_tick >= drop.pulse_us)
        release_off(0);
    while (drop.fallen < FALL &&
           now - drop.fire_tick >= fall[drop.fallen].at_ms * TICKS_PER_MS &&
           fall[drop.fallen].at_ms < drop.record_ms) {
        uint16_t state = fall[drop.fallen].state & drop.gates;
        uint16_t before =
            drop.count ? get16(drop.events + (size_t)(drop.count - 1) * EVENT_SIZE + 4) : 0;
        if (state != before) {
            struct frame event = {0}; /* only to put numbers into */
            put32(&event, drop.fire_tick + fall[drop.fallen].at_ms * TICKS_PER_MS);
            put16(&event, state);
            memcpy(drop.events + (size_t)drop.count++ * EVENT_SIZE, event.payload, EVENT_SIZE);
        }
        drop.fallen++;
    }
    if (now - drop.fire_tick >= drop.record_ms * TICKS_PER_MS)
        hold();
}

int main(void)
{
    struct reader reader = {.count = 0};
    struct frame frame = begin(BOOT);
    struct termios raw;
    int near;
    line = posix_openpt(O_RDWR | O_NOCTTY);
    if (line < 0 || grantpt(line) || unlockpt(line) ||
        (near = open(ptsname(line), O_RDWR | O_NOCTTY)) < 0 || tcgetattr(near, &raw)) {
        perror("no terminal");
        return 1;
    }
    raw.c_iflag = raw.c_oflag = raw.c_lflag = 0;
    raw.c_cc[VMIN] = 1;
    tcsetattr(near, TCSANOW, &raw);
    fcntl(line, F_SETFL, O_NONBLOCK);
    printf("%s\n", ptsname(line));
    fflush(stdout);
    put8(&frame, 1); /* power */
    send(&frame);
    for (;;) {
        struct pollfd waiting = {.fd = line, .events = POLLIN};
        uint8_t bytes[FRAME_LIMIT];
        ssize_t count;
        poll(&waiting, 1, 1);
        while ((count = read(line, bytes, sizeof bytes)) > 0)
            for (ssize_t n = 0; n < count; n++)
                if (frame_read(&reader, bytes[n], &frame))
                    answer(&frame);
        pass();
    }
}
