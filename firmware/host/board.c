#include "board.h"

#include <string.h>

#include "device.h"
#include "events.h"
#include "host.h"
#include "name.h"
#include "ticks.h"

#define CHANGES 8192
#define LINE 65536
#define REFERENCES 16
#define SYNC 0x80 /* in `outputs`, beside the releases */

extern uint8_t __start_kept[], __stop_kept[]; /* by the linker, of all that is BOARD_KEPT */

static uint64_t now, base; /* base: what the 32-bit time is ahead of `now` */

static struct {
    uint64_t when[CHANGES];
    uint8_t gate[CHANGES];
    bool blocked[CHANGES];
    uint32_t first, end;
} changes;

struct line {
    uint64_t when[LINE]; /* when each byte is complete */
    uint8_t byte[LINE];
    uint32_t first, end;
    uint64_t free;
};
static struct line to_device, to_host;

static uint16_t gates, watched, lost;
static bool flag[2];
static uint64_t interrupt_free, flagged;
static uint8_t *tail, *stop;
static uint8_t half;
static uint8_t outputs;
static bool stopped;
static uint64_t fire_at, sense_after, release_end;
static uint64_t references[REFERENCES];
static uint8_t reference_first, reference_end;
static bool sense_waits;
static uint8_t name[NAME_RECORD];

/* -- the core's side */

uint16_t board_count(void)
{
    return (uint16_t)(now + base);
}

uint16_t board_count_roughly(void)
{
    return (uint16_t)(board_count() + now / HOST_TURN % 2 * 250);
}

void board_publish_half(uint8_t value)
{
    half = value;
}

uint16_t board_gates(void)
{
    return gates;
}

void board_watch(uint16_t mask)
{
    watched = mask;
    flag[0] = flag[1] = false;
}

uint8_t *board_entries_end(void)
{
    return tail;
}

bool board_has_entry(const uint8_t *entry)
{
    return entry != tail;
}

void board_entries_start(uint8_t *memory, uint8_t *last)
{
    tail = memory;
    stop = last;
    lost = 0;
}

bool board_entries_rewind(const uint8_t *from, uint8_t *to)
{
    if (tail != from)
        return false;
    tail = to;
    return true;
}

void board_entries_stop(uint8_t *slot)
{
    stop = slot;
}

uint16_t board_entries_lost(void)
{
    return lost;
}

void board_resume(void)
{
}

void board_sync(bool on)
{
    outputs = (uint8_t)((outputs & ~SYNC) | (on ? SYNC : 0));
}

void board_release_end(uint16_t count)
{
    release_end = now + (uint16_t)(count - board_count());
}

void board_release_off(void)
{
    outputs &= SYNC;
}

bool board_release_high(void)
{
    return outputs & ~SYNC;
}

uint32_t board_release_cut(void)
{
    return 0;
}

uint16_t board_supply(void)
{
    return 1;
}

uint16_t board_supply_mv(uint16_t measured)
{
    return (uint16_t)(5000 * measured);
}

uint16_t board_fire(uint8_t release, uint32_t ticks)
{
    outputs = (uint8_t)(release | SYNC);
    release_end = now + ticks;
    fire_at = now;
    return board_count();
}

bool board_stopped(void)
{
    return stopped;
}

bool board_reference(uint16_t *count)
{
    uint64_t at;
    if (reference_first == reference_end || now < references[reference_first])
        return false;
    at = references[reference_first++];
    *count = (uint16_t)(at + base);
    return true;
}

void board_sense_begin(void)
{
    sense_waits = sense_after != 0;
}

bool board_sensed(uint16_t *count)
{
    if (!sense_waits || now < fire_at + sense_after)
        return false;
    *count = (uint16_t)(fire_at + sense_after + base);
    sense_waits = false;
    return true;
}

bool board_receive(uint8_t *byte)
{
    if (to_device.first == to_device.end || to_device.when[to_device.first % LINE] > now)
        return false;
    *byte = to_device.byte[to_device.first++ % LINE];
    return true;
}

static bool line_put(struct line *line, uint64_t when, uint8_t byte)
{
    if (line->end - line->first == LINE)
        return false;
    line->free = (line->free > when ? line->free : when) + HOST_BYTE;
    line->when[line->end % LINE] = line->free;
    line->byte[line->end++ % LINE] = byte;
    return true;
}

uint8_t board_send(const uint8_t *bytes, uint8_t count)
{
    /* One byte in the shifter and one waiting. */
    return count && to_host.free <= now + HOST_BYTE && line_put(&to_host, now, *bytes);
}

void board_led(bool on)
{
    (void)on;
}

void board_kick(void)
{
}

void board_name(uint8_t to[])
{
    memcpy(to, name, sizeof name);
}

void board_rename(const uint8_t from[])
{
    memcpy(name, from, sizeof name);
}

/* -- the hands */

static void change(uint8_t gate, bool blocked)
{
    uint16_t bit = (uint16_t)(1 << gate);
    if (!(gates & bit) == !blocked)
        return;
    gates ^= bit;
    if (watched & bit && !flag[gate >> 3]) {
        if (!flag[0] && !flag[1])
            flagged = now;
        flag[gate >> 3] = true;
    }
}

static void interrupt(void)
{
    uint8_t port = flag[0] ? 0 : 1, *entry = tail;
    uint16_t count = board_count();
    flag[port] = false;
    interrupt_free = now + HOST_BUSY;
    if (entry == stop) {
        if (lost != UINT16_MAX)
            lost++;
        return;
    }
    entry[0] = (uint8_t)count;
    entry[1] = (uint8_t)(count >> 8);
    entry[2] = half;
    entry[3] = port;
    entry[4] = (uint8_t)gates;
    entry[5] = (uint8_t)(gates >> 8);
    tail += EVENT_SIZE;
    if (BOARD_STREAMS && tail == events_memory + EVENTS_BYTES)
        tail = events_memory;
}

static uint64_t later(uint64_t a, uint64_t b)
{
    return a > b ? a : b;
}

/* What the gates and their interrupt do until a moment. */
static void gates_until(uint64_t until)
{
    for (;;) {
        uint64_t next = until, runs = UINT64_MAX;
        if (flag[0] || flag[1])
            runs = later(flagged, interrupt_free) + HOST_LATENCY;
        if (changes.first != changes.end)
            next = changes.when[changes.first % CHANGES];
        if (runs <= until && runs <= next) {
            now = later(now, runs);
            interrupt();
        } else if (changes.first != changes.end && next <= until) {
            now = later(now, next);
            change(changes.gate[changes.first % CHANGES], changes.blocked[changes.first % CHANGES]);
            changes.first++;
        } else {
            now = later(now, until);
            return;
        }
    }
}

uint64_t host_run(uint64_t until)
{
    while (now + HOST_TURN <= until) {
        gates_until(now + HOST_TURN);
        if (now >= release_end)
            board_release_off();
        device_pass();
    }
    return now;
}

bool host_change(uint64_t when, uint8_t gate, bool blocked)
{
    if (changes.end - changes.first == CHANGES)
        return false;
    changes.when[changes.end % CHANGES] = when;
    changes.gate[changes.end % CHANGES] = gate;
    changes.blocked[changes.end++ % CHANGES] = blocked;
    return true;
}

bool host_feed(uint64_t when, uint8_t byte)
{
    return line_put(&to_device, when, byte);
}

int host_take(uint64_t *when)
{
    if (to_host.first == to_host.end || to_host.when[to_host.first % LINE] > now)
        return -1;
    *when = to_host.when[to_host.first % LINE];
    return to_host.byte[to_host.first++ % LINE];
}

void host_stop(bool open)
{
    stopped = open;
}

void host_reference(uint64_t when)
{
    if (reference_first == reference_end)
        reference_first = reference_end = 0;
    if (reference_end < REFERENCES)
        references[reference_end++] = when;
}

void host_sense(uint64_t after_fire)
{
    sense_after = after_fire;
}

uint8_t host_outputs(void)
{
    return (uint8_t)(outputs & ~SYNC);
}

void host_reset(uint8_t cause)
{
    to_device.first = to_device.end;
    to_host.first = to_host.end;
    to_host.free = to_device.free = now;
    changes.first = changes.end;
    device_start(cause);
}

void host_power(uint32_t tick)
{
    now = 1; /* 0 stands for never */
    base = (uint64_t)tick - 1;
    gates = 0;
    stopped = false;
    sense_after = fire_at = 0;
    reference_first = reference_end = 0;
    interrupt_free = 0;
    memset(name, 0xFF, sizeof name);
    memset(__start_kept, 0xA5, (uintptr_t)__stop_kept - (uintptr_t)__start_kept);
    host_reset(1);
}
