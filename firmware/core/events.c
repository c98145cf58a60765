#include "events.h"

#include "bytes.h"
#include "checks.h"
#include "ticks.h"

/* A wake-up that follows within this many ticks may be owed to what the one before it saw. */
#define AT_ONCE (BOARD_BUSY + 16)

uint8_t events_memory[EVENTS_BYTES] BOARD_KEPT;
struct events events;

static struct {
    uint8_t *entry;     /* the next one to turn into an event */
    uint8_t *event;     /* where the next event goes; never ahead of `entry` */
    uint16_t gates;     /* those that count */
    uint16_t ports;     /* both ports after the latest entry, masked */
    uint32_t stamp;     /* of the latest entry */
    uint32_t last;      /* of the latest event */
    uint8_t excused[2]; /* whether one more wake-up of this port tells nothing new */
    uint8_t lead, most; /* entries that left no event since the last rewind, and the most ever */
} at;

static uint8_t *after(const uint8_t *slot)
{
    slot += EVENT_SIZE;
    if (BOARD_STREAMS && slot == events_memory + EVENTS_BYTES)
        slot = events_memory;
    return (uint8_t *)slot;
}

/* Where the interrupt must stop: the end, or in a ring the slot before the first event unsent, so
 * that full and empty can be told apart. */
static uint8_t *last_slot(void)
{
    if (!BOARD_STREAMS || events.unsent == events_memory)
        return events_memory + EVENTS_BYTES - BOARD_STREAMS * EVENT_SIZE;
    return (uint8_t *)events.unsent - EVENT_SIZE;
}

void events_start(uint16_t gates)
{
    events.count = events.glitches = events.late = events.sent = 0;
    events.crc = CRC32_START;
    events.unsent = events_memory;
    at.entry = at.event = events_memory;
    at.gates = gates;
    at.ports = 0;
    at.stamp = at.last = ticks_now() - BOARD_LATE;
    at.excused[0] = at.excused[1] = 0;
    at.lead = at.most = 0;
    board_entries_start(events_memory, last_slot());
}

/* Whether the entry tells something new. The interrupt reads both ports whenever one of them has
 * changed, so a change may have been seen before its own wake-up comes: the other port's, or a
 * second gate's of the same port between wake-up and reading. Such a wake-up follows at once and
 * finds nothing new. Any other that finds nothing new was a pulse too short to be seen; its second
 * edge may wake us once more. */
static bool is_news(uint8_t port, uint16_t ports, bool at_once)
{
    uint16_t changed = (uint16_t)(at.ports ^ ports);
    uint8_t own = (uint8_t)(port ? changed >> 8 : changed);
    uint8_t other = (uint8_t)(port ? changed : changed >> 8);
    if (!at_once)
        at.excused[0] = at.excused[1] = 0;
    if (!changed && at.excused[port]) {
        at.excused[port] = 0;
        return false;
    }
    at.excused[port] = !changed || (own & (uint8_t)(own - 1)) != 0;
    if (other)
        at.excused[!port] = 1;
    return true;
}

static void keep(uint16_t ports, uint32_t stamp)
{
    uint8_t *event = at.event;
    uint32_t crc = events.crc;
    uint8_t n;
    if (ports == at.ports)
        events.glitches++;
    if (stamp - at.last < BOARD_LATE)
        events.late++;
    at.last = stamp;
    put32(event, stamp - BOARD_LATENCY);
    put16(event + 4, board_gates_of((uint8_t)ports, (uint8_t)(ports >> 8)));
    for (n = 0; n < EVENT_SIZE; n++)
        crc = crc32_add(crc, event[n]);
    events.crc = crc;
    events.count++;
    at.event = after(event);
}

static void rewind_entries(void)
{
    if (at.entry != at.event && board_entries_rewind(at.entry, at.event)) {
        at.entry = at.event;
        at.lead = 0;
    }
}

bool events_pass(void)
{
    uint8_t *entry = at.entry;
    uint8_t port;
    uint16_t ports;
    uint32_t stamp, since;
    if (!board_has_entry(entry)) {
        /* What left no event has its memory back as soon as the gates are quiet. */
        rewind_entries();
        return false;
    }
    stamp = ticks_stamped(get16(entry), entry[2]);
    since = stamp - at.stamp;
    port = entry[3];
    ports = (uint16_t)(get16(entry + 4) & board_ports_of(at.gates));
    at.entry = after(entry);
    /* An edge that came while the interrupt was busy waited for its end, nobody knows how long:
     * half of the longest is the best guess, and off by no more than half. */
    if (is_news(port, ports, since <= AT_ONCE))
        keep(ports, since <= BOARD_BUSY ? stamp - since / 2 : stamp);
    else if (++at.lead > at.most)
        at.most = at.lead;
    at.ports = ports;
    at.stamp = stamp;
    return true;
}

bool events_settled(void)
{
    return board_entries_end() == at.entry;
}

uint16_t events_moved(bool *flicker)
{
    uint16_t moved = 0;
    while (board_has_entry(at.entry)) {
        ticks_pass(); /* there may be many */
        uint16_t ports = (uint16_t)(get16(at.entry + 4) & board_ports_of(at.gates));
        moved |= board_gates_of((uint8_t)ports, (uint8_t)(ports >> 8));
        *flicker |= ports == 0;
        at.entry = after(at.entry);
    }
    rewind_entries();
    return moved;
}

void events_sent_one(void)
{
    events.sent++;
    events.unsent = after(events.unsent);
}

uint16_t events_first_kept(void)
{
    /* One slot stays empty, and entries that left no event have gone over old events too. */
    uint16_t kept = (uint16_t)(BOARD_CAPACITY - 1 - at.most);
    return BOARD_STREAMS && events.count > kept ? (uint16_t)(events.count - kept) : 0;
}

const uint8_t *events_at(uint16_t index)
{
    if (BOARD_STREAMS)
        index %= BOARD_CAPACITY;
    return events_memory + index * EVENT_SIZE;
}

void events_free_sent(void)
{
    if (BOARD_STREAMS)
        board_entries_stop(last_slot());
}

uint32_t events_crc(uint16_t count)
{
    uint32_t crc = CRC32_START;
    const uint8_t *byte = events_memory, *end = events_memory + count * EVENT_SIZE;
    while (byte != end)
        crc = crc32_add(crc, *byte++);
    return ~crc;
}
