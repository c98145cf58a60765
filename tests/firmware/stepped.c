/* Linked into a device (ld --wrap) in place of its clock and its line: time passes, and bytes come
 * and go, as the program at its standard input and output says. */
#define _XOPEN_SOURCE 700

#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static struct { uint32_t until_us, count; } order;
static uint32_t now_us, came, sent;
static uint8_t in[1 << 16], out[1 << 16];

int __wrap_clock_gettime(clockid_t clock, struct timespec *now)
{
    (void)clock;
    now->tv_sec = now_us / 1000000;
    now->tv_nsec = now_us % 1000000 * 1000;
    return 0;
}

int __wrap_poll(struct pollfd *waiting, nfds_t count, int ms)
{
    (void)waiting, (void)count;
    while (now_us + (uint32_t)ms * 1000 > order.until_us) {
        fwrite(&sent, sizeof sent, 1, stdout);
        fwrite(out, 1, sent, stdout);
        fflush(stdout);
        came = sent = 0;
        if (fread(&order, sizeof order, 1, stdin) != 1 ||
            fread(in, 1, order.count, stdin) != order.count)
            exit(0);
        if (order.count)
            return 1;
    }
    now_us += (uint32_t)ms * 1000;
    return 0;
}

ssize_t __wrap_read(int line, void *bytes, size_t limit)
{
    size_t left = order.count - came, count = left < limit ? left : limit;
    (void)line;
    memcpy(bytes, in + came, count);
    came += (uint32_t)count;
    return (ssize_t)count;
}

ssize_t __wrap_write(int line, const void *bytes, size_t count)
{
    (void)line;
    memcpy(out + sent, bytes, count);
    sent += (uint32_t)count;
    return (ssize_t)count;
}
