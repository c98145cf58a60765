#include "capture.h"

#include "board.h"
#include "programs.h"
#include "pio.h"
#include "registers.h"
#include "release_machine.h"

#define GATES 0u /* state machine, and DMA channel */
#define OTHERS 1u
#define FIRST_OTHER 16u /* the pin that is bit 0 of what the second one stamps */

#define GATES_RING_BITS 15 /* bytes, as a power of two: DMA's largest, and 4096 stamps */
#define OTHERS_RING_BITS 9
#define GATES_ROOM (1u << GATES_RING_BITS >> 3) /* stamps */
#define OTHERS_ROOM (1u << OTHERS_RING_BITS >> 3)

#define SHIFT_LEFT_AND_JOIN (1u << 31) /* one FIFO of eight words, to the processor */
#define WORN (DMA_FOR_EVER / 2)

struct stamp {
    uint32_t states; /* before in the upper half, now in the lower */
    uint32_t count;  /* down from all ones */
};

static volatile uint32_t gates_words[1u << GATES_RING_BITS >> 2]
    __attribute__((section(".ring"), aligned(1u << GATES_RING_BITS)));
static volatile uint32_t others_words[1u << OTHERS_RING_BITS >> 2]
    __attribute__((aligned(1u << OTHERS_RING_BITS)));

static struct ring {
    volatile uint32_t *words;
    uint32_t bits;    /* its bytes, as a power of two */
    uint32_t last;    /* index of its last word */
    uint32_t read;    /* words, since DMA began */
    uint32_t written; /* at the latest look */
    bool broken;      /* a word was lost: which half of a stamp comes next is not known */
} rings[] = {
    [GATES] = {gates_words, GATES_RING_BITS, 2 * GATES_ROOM - 1, 0, 0, false},
    [OTHERS] = {others_words, OTHERS_RING_BITS, 2 * OTHERS_ROOM - 1, 0, 0, false},
};

static uint16_t watched;
static uint8_t *entry, *entries_stop;
static uint16_t lost;
static uint32_t started; /* the timer's microseconds then */

static struct {
    bool changed;
    uint16_t count;
} reference, sense, sync;

/* -- the rings */

static void ring_start(uint32_t machine)
{
    struct ring *ring = &rings[machine];
    REGISTER(DMA_READ(machine)) = PIO_RX(machine);
    REGISTER(DMA_WRITE(machine)) = (uint32_t)ring->words;
    REGISTER(DMA_COUNT(machine)) = DMA_FOR_EVER;
    ring->read = ring->written = 0;
    REGISTER(DMA_CTRL(machine)) = DMA_ON | DMA_FIRST | DMA_WORDS | DMA_TO_RING(ring->bits) |
                                  DMA_CHAIN_TO(machine) | DMA_PACED_BY_RX(machine) | DMA_SILENT;
}

/* DMA's count of words has an end, after weeks of a gate that flickers: begin anew before it. */
static void ring_renew(uint32_t machine)
{
    bool slipped;
    REGISTER(DMA_ABORT) = 1u << machine;
    while (REGISTER(DMA_ABORT) & 1u << machine)
        ;
    slipped = DMA_FOR_EVER - REGISTER(DMA_COUNT(machine)) != rings[machine].written;
    ring_start(machine);
    rings[machine].broken |= slipped;
}

/* How many stamps wait in a ring. Where DMA came too late for a FIFO of eight words, what was lost
 * may be half a stamp: then nothing counts until the machine is seen at rest. */
static uint32_t stamps_waiting(uint32_t machine)
{
    struct ring *ring = &rings[machine];
    uint32_t lost_word = PIO_LOST_WORD << machine;
    uint32_t written = DMA_FOR_EVER - REGISTER(DMA_COUNT(machine));
    bool rests = written == ring->written && REGISTER(PIO_FSTAT) & PIO_RX_EMPTY << machine;
    ring->written = written;
    if (REGISTER(PIO_FDEBUG) & lost_word) {
        REGISTER(PIO_FDEBUG) = lost_word;
        ring->broken = true;
        return 0;
    }
    if (ring->broken) {
        ring->read = written;
        ring->broken = !rests;
    } else if (rests && written == ring->read && written >= WORN) {
        ring_renew(machine);
        return 0;
    }
    return (written - ring->read) / 2;
}

static uint32_t next_word(struct ring *ring)
{
    return ring->words[ring->read++ & ring->last];
}

static struct stamp next_stamp(uint32_t machine)
{
    struct stamp stamp;
    stamp.states = next_word(&rings[machine]);
    stamp.count = next_word(&rings[machine]);
    return stamp;
}

/* -- the start */

static void machine_start(uint32_t machine, uint32_t first_pin)
{
    REGISTER(PIO_CLKDIV(machine)) = 1u << 16;
    REGISTER(PIO_EXECCTRL(machine)) = CAPTURE_WRAP << 12 | CAPTURE_START << 7;
    REGISTER(PIO_SHIFTCTRL(machine)) = SHIFT_LEFT_AND_JOIN;
    REGISTER(PIO_PINCTRL(machine)) = first_pin << 15;
    REGISTER(PIO_INSTR(machine)) = PIO_MOV_NOT(OSR, NOTHING);
    REGISTER(PIO_INSTR(machine)) = PIO_IN(PINS, 16);
    REGISTER(PIO_INSTR(machine)) = PIO_IN(PINS, 16);
    REGISTER(PIO_INSTR(machine)) = PIO_MOV(X, ISR);
    REGISTER(PIO_INSTR(machine)) = PIO_JMP(CAPTURE_START);
    ring_start(machine);
}

void capture_start(void)
{
    uint32_t n;
    for (n = 0; n < PROGRAM_WORDS; n++)
        REGISTER(PIO_MEMORY(n)) = programs[n];
    REGISTER(BUS_PRIORITY) = BUS_DMA_READS | BUS_DMA_WRITES; /* it waits for nobody */
    machine_start(GATES, 0);
    machine_start(OTHERS, FIRST_OTHER);
    release_machine_start();
    started = REGISTER(TIMER_RAW_LOW);
    while (REGISTER(TIMER_RAW_LOW) == started)
        ;
    /* All in the same clock, and their dividers with them. */
    REGISTER(PIO_CTRL) = 1u << GATES | 1u << OTHERS | 1u << RELEASE_MACHINE |
                         (1u << GATES | 1u << OTHERS | 1u << RELEASE_MACHINE) << 8;
}

/* -- time */

/* The timer counts the same crystal's microseconds. It began a little before the machines and is
 * rounded up here, so that no stamp is ever in the future. */
uint16_t board_count(void)
{
    return (uint16_t)((REGISTER(TIMER_RAW_LOW) - started) * (BOARD_HZ / 1000000u));
}

uint16_t board_count_roughly(void)
{
    return board_count();
}

/* -- gates */

uint16_t board_gates(void)
{
    return (uint16_t)REGISTER(SIO_IN);
}

static void write_entry(uint16_t changed, uint16_t gates, uint32_t tick)
{
    if (entry == entries_stop) {
        if (lost != UINT16_MAX)
            lost++;
        return;
    }
    entry[0] = (uint8_t)tick;
    entry[1] = (uint8_t)(tick >> 8);
    entry[2] = (uint8_t)((tick >> 15) - 1); /* the half before, which the core knows for sure */
    entry[3] = (changed & 0xFF) == 0;
    entry[4] = (uint8_t)gates;
    entry[5] = (uint8_t)(gates >> 8);
    entry += 6;
}

/* Turn what DMA has written into entries. */
static void gates_pass(void)
{
    uint32_t waiting = stamps_waiting(GATES);
    if (waiting >= GATES_ROOM || rings[GATES].broken) {
        /* The ring went round before it was read, or words were lost: no stamp can be trusted. */
        if (watched)
            lost = UINT16_MAX;
        rings[GATES].read += 2 * waiting;
        return;
    }
    while (waiting--) {
        struct stamp stamp = next_stamp(GATES);
        uint16_t changed = (uint16_t)((stamp.states ^ stamp.states >> 16) & watched);
        if (changed)
            write_entry(changed, (uint16_t)stamp.states, ~stamp.count);
    }
}

void board_watch(uint16_t gates)
{
    gates_pass(); /* by the old order */
    watched = gates;
}

void board_entries_start(uint8_t *memory, uint8_t *stop)
{
    entry = memory;
    entries_stop = stop;
    lost = 0;
}

void board_entries_stop(uint8_t *slot)
{
    entries_stop = slot;
}

uint8_t *board_entries_end(void)
{
    gates_pass();
    return entry;
}

bool board_has_entry(const uint8_t *at)
{
    return entry != at || board_entries_end() != at;
}

bool board_entries_rewind(const uint8_t *from, uint8_t *to)
{
    if (entry != from)
        return false;
    entry = to;
    return true;
}

uint16_t board_entries_lost(void)
{
    return lost;
}

/* -- the other pins */

static bool has(uint32_t states, uint32_t pin)
{
    return states >> (pin - FIRST_OTHER) & 1;
}

void capture_pass(void)
{
    uint32_t waiting = stamps_waiting(OTHERS);
    if (waiting >= OTHERS_ROOM) { /* contacts that bounce for so long tell nothing */
        rings[OTHERS].read += 2 * waiting;
        return;
    }
    while (waiting--) {
        struct stamp stamp = next_stamp(OTHERS);
        uint32_t states = stamp.states, changed = states ^ states >> 16;
        uint16_t count = (uint16_t)(~stamp.count - BOARD_LATENCY);
        if (has(changed & states, REFERENCE)) {
            reference.changed = true;
            reference.count = count;
        }
        if (has(changed, SENSE) && !sense.changed) {
            sense.changed = true;
            sense.count = count;
        }
        if (has(changed & states, SYNC)) {
            sync.changed = true;
            sync.count = count;
        }
    }
}

bool board_reference(uint16_t *count)
{
    bool changed;
    capture_pass();
    changed = reference.changed;
    *count = reference.count;
    reference.changed = false;
    return changed;
}

void board_sense_begin(void)
{
    capture_pass();
    sense.changed = false;
}

bool board_sensed(uint16_t *count)
{
    capture_pass();
    *count = sense.count;
    return sense.changed;
}

/* The sync output goes on in the same clock as the releases, and the machine that stamps the other
 * pins sees it as the gates' machine would. */
uint16_t board_fire(uint8_t release, uint32_t ticks)
{
    uint32_t began = REGISTER(TIMER_RAW_LOW);
    uint16_t ordered;
    capture_pass();
    sync.changed = false;
    release_machine_fire(release, ticks ? ticks : 1);
    ordered = board_count(); /* for a sync output that is held down: right to a microsecond */
    while (!sync.changed && REGISTER(TIMER_RAW_LOW) - began < 5)
        capture_pass();
    return sync.changed ? sync.count : ordered;
}
