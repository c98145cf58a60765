/* A client of one's own, written from PROTOCOL.md alone: one drop, as CSV on stdout.
 *
 *     cc -o client client.c frames.c && ./client /dev/ttyACM0 0x0003 500
 *
 * PORT, mask of gates, milliseconds to record; no release is driven. A drop that the device holds
 * already is fetched instead.
 */
#define _DEFAULT_SOURCE

#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "frames.h"

enum { IDENTIFY = 1, STATUS = 3, ARM, FIRE, READ = 7, ACKNOWLEDGE };
enum { IDENTITY = 0x81, STATE = 0x83, ARMED, FIRED, REFUSED, DONE, EVENTS, BOOT = 0x8B, CERTIFICATE = 0x8D };
enum { IDLE, IS_ARMED, RECORDING, HOLDING };

#define PROTOCOL 2
#define EVENT_SIZE 6
#define MOST 65535
#define LABEL (1 | 1 << 16) /* run 1, attempt 1 */
#define TRIES 8
#define BOOT_S 2.0
#define LOADER_S 6.0

static int line;
static uint8_t seq;
static struct reader reader;

static uint8_t events[(size_t)MOST * EVENT_SIZE];
static bool have[MOST];
static struct frame certificate; /* size 0: none yet */

static void fail(const char *what)
{
    fprintf(stderr, "%s\n", what);
    exit(1);
}

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Events and certificates count whenever they come. */
static void keep(const struct frame *frame)
{
    if (frame->type == CERTIFICATE)
        certificate = *frame;
    if (frame->type != EVENTS)
        return;
    size_t first = get16(frame->payload + 4), count = (frame->size - 6u) / EVENT_SIZE;
    for (size_t n = 0; n < count && first + n < MOST; n++) {
        memcpy(events + (first + n) * EVENT_SIZE, frame->payload + 6 + n * EVENT_SIZE, EVENT_SIZE);
        have[first + n] = true;
    }
}

/* Listens until a frame of a type comes, or any that answers request `ack`. */
static bool hear(double wait_s, uint8_t type, uint8_t ack, struct frame *frame)
{
    static uint8_t bytes[FRAME_LIMIT];
    static ssize_t count, at;
    double end = seconds() + wait_s;
    for (;;) {
        while (at < count) {
            if (!frame_read(&reader, bytes[at++], frame))
                continue;
            keep(frame);
            if (ack ? frame->ack == ack : frame->type == type)
                return true;
        }
        double left = end - seconds();
        struct pollfd waiting = {.fd = line, .events = POLLIN};
        if (left <= 0 || poll(&waiting, 1, (int)(1e3 * left) + 1) <= 0)
            return false;
        at = 0;
        count = read(line, bytes, sizeof bytes);
        if (count <= 0)
            fail("the line is dead");
    }
}

/* Sends a request until it is answered. */
static bool ask(struct frame *request, struct frame *answer)
{
    uint8_t bytes[FRAME_LIMIT];
    double wait_s = request->type == FIRE ? 0.05 : 0.1;
    seq = seq % 255 + 1;
    request->seq = seq;
    size_t count = frame_write(request, bytes);
    for (int n = 0; n < TRIES; n++) {
        if (write(line, bytes, count) != (ssize_t)count)
            fail("the line is dead");
        if (hear(wait_s, 0, seq, answer))
            return true;
        wait_s = wait_s * 1.5 < 0.5 ? wait_s * 1.5 : 0.5;
    }
    return false;
}

static struct frame request(uint8_t type)
{
    struct frame frame = {.type = type};
    return frame;
}

/* Asks for what must be answered so. */
static struct frame want(struct frame asked, uint8_t type)
{
    struct frame answer;
    if (!ask(&asked, &answer))
        fail("the device is silent");
    if (answer.type == REFUSED) {
        fprintf(stderr, "refused: reason %d, detail %d\n", answer.payload[0], get16(answer.payload + 1));
        exit(1);
    }
    if (answer.type != type)
        fail("that is no answer to what was asked");
    return answer;
}

static void connect_to(const char *port)
{
    struct termios raw;
    struct frame frame = request(IDENTIFY), answer;
    line = open(port, O_RDWR | O_NOCTTY);
    if (line < 0 || tcgetattr(line, &raw))
        fail("this port cannot be used");
    cfmakeraw(&raw);
    cfsetspeed(&raw, B500000);
    tcsetattr(line, TCSANOW, &raw);
    if (write(line, "", 1) != 1) /* one zero byte */
        fail("the line is dead");
    bool booted = hear(BOOT_S, BOOT, 0, &answer);
    put8(&frame, PROTOCOL);
    if (!ask(&frame, &answer)) {
        if (booted || !hear(LOADER_S, BOOT, 0, &answer) || !ask(&frame, &answer))
            fail("nobody is there");
    }
    if (answer.type != IDENTITY)
        fail("the device speaks another version");
    fprintf(stderr, "%.*s\n", answer.payload[1], (const char *)answer.payload + 2);
}

static void make_drop(uint16_t gates, uint16_t record_ms)
{
    struct frame frame = request(ARM), answer;
    put32(&frame, LABEL);
    put16(&frame, gates);
    put8(&frame, 0);
    put32(&frame, 0);
    put16(&frame, 1000); /* timeout_ms */
    put16(&frame, record_ms);
    answer = want(frame, ARMED);
    frame = request(FIRE);
    put32(&frame, get32(answer.payload));
    want(frame, FIRED);
    hear(1e-3 * record_ms + 1.0, CERTIFICATE, 0, &answer); /* and the host is silent */
}

static void fetch(uint32_t label)
{
    if (certificate.size == 0) {
        struct frame frame = request(READ);
        put32(&frame, label);
        put16(&frame, 0);
        put8(&frame, 0);
        want(frame, CERTIFICATE);
    }
    uint16_t count = get16(certificate.payload + 12);
    for (uint16_t first = 0; first < count; first++) {
        struct frame frame = request(READ);
        if (have[first])
            continue;
        put32(&frame, label);
        put16(&frame, first);
        put8(&frame, 16);
        want(frame, EVENTS);
        if (!have[first])
            fail("the device does not send what was asked for");
    }
    if (count && crc32(events, (size_t)count * EVENT_SIZE) != get32(certificate.payload + 14))
        fail("the events are not those of the certificate");
}

int main(int argc, char **argv)
{
    struct frame state, frame;
    if (argc != 4)
        fail("usage: client PORT GATES RECORD_MS");
    connect_to(argv[1]);
    do
        state = want(request(STATUS), STATE);
    while (state.payload[0] == RECORDING);
    if (state.payload[0] != HOLDING)
        make_drop((uint16_t)strtoul(argv[2], NULL, 0), (uint16_t)strtoul(argv[3], NULL, 0));
    state = want(request(STATUS), STATE);
    fetch(get32(state.payload + 3));
    printf("ticks since FIRE,state\n");
    for (uint16_t n = 0; n < get16(certificate.payload + 12); n++) {
        const uint8_t *event = events + (size_t)n * EVENT_SIZE;
        int32_t since = (int32_t)(get32(event) - get32(certificate.payload + 4));
        printf("%ld,%u\n", (long)since, (unsigned)get16(event + 4));
    }
    fflush(stdout); /* safe: now the device may forget it */
    frame = request(ACKNOWLEDGE);
    put32(&frame, get32(certificate.payload));
    put32(&frame, get32(certificate.payload + 14));
    want(frame, DONE);
    return 0;
}
