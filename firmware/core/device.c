#include "device.h"

#include <stdbool.h>

#include "board_api.h"
#include "bytes.h"
#include "drop.h"
#include "events.h"
#include "name.h"
#include "receive.h"
#include "release.h"
#include "send.h"
#include "ticks.h"
#include "wire.h"

#define BATCH 16                          /* events in a frame */
#define COMPANY_TICKS (10 * TICKS_PER_MS) /* an event waits no longer than this for others */
#define STOP_TICKS (300 * TICKS_PER_US) /* the emergency stop's input is the same for so long */
#define RESTARTED 128
#define POWER_ON 1                       /* in BOOT's cause */
#define SELDOM 16                         /* turns between two looks at what has time */

/* What is rare must not put its registers' saving into every turn of the main loop. */
#define RARE __attribute__((noinline))

static const char firmware[] BOARD_FLASH = "chainrig " FIRMWARE_VERSION;

static uint8_t phase;
static struct request request;
static bool requested; /* `request` waits to be executed */

static struct {
    uint32_t label, token, pulse_us;
    uint16_t gates, record_ms;
    uint8_t release;
    uint32_t since, timeout; /* ticks */
    uint32_t heard;          /* when the host was */
    uint16_t moved;          /* gates that changed since */
    bool flicker;            /* or some gate did, too short to say which */
} order;

static struct {
    bool open;      /* the emergency stop, as it was for at least STOP_TICKS */
    bool wavers;    /* and reads otherwise since then */
    uint32_t since;
} stop;

static struct {
    uint16_t now, worst; /* measures of the supply, larger when it is lower; 0: none yet */
} supply;

/* Restarts since IDENTIFY, for the certificate: the memory outlives them. */
static struct {
    uint8_t causes, check;
} restarts BOARD_KEPT;
static uint8_t untold;  /* the DISARM_REASON that the host has still to be told, or 0 */
static bool aborted;    /* ABORT came for the drop that is recorded or held */
static bool leaving;    /* for the program that takes firmware */
static bool closing;    /* the recording is over, but not everything is sent */
static uint8_t room;    /* events that still belong into the frame being written */
static uint32_t lately; /* the time, at most SELDOM turns ago */
static uint32_t chance;

/* The answer to the last request, for a repeat of it that must not be executed again. */
static struct {
    uint16_t crc;
    uint8_t seq, type, code, size;
    uint8_t payload[4];
} last;

static void note_restarts(uint8_t causes)
{
    restarts.causes = causes;
    restarts.check = (uint8_t)~causes;
}

/* -- answers */

static void answer_again(void)
{
    uint8_t n;
    send_begin(last.code, last.seq);
    for (n = 0; n < last.size; n++)
        send8(last.payload[n]);
    send_end();
}

static void answer(uint8_t code, uint8_t size, uint32_t payload)
{
    last.code = code;
    last.size = size;
    put32(last.payload, payload);
    answer_again();
}

static void done(void)
{
    answer(MSG_DONE, DONE_SIZE, 0);
}

static void refuse(uint8_t reason, uint16_t detail)
{
    answer(MSG_REFUSED, REFUSED_SIZE, reason | (uint32_t)detail << 8);
}

static void send_text(const char *text, uint8_t size)
{
    send8(size);
    while (size--)
        send8((uint8_t)board_flash8(text++));
}

static void send_events(uint16_t first, uint16_t end, uint8_t ack)
{
    send_begin(MSG_EVENTS, ack);
    send32(drop.label);
    send16(first);
    for (; first != end; first++)
        send_bytes(events_at(first), EVENT_SIZE);
    send_end();
}

/* -- chance, for tokens and for the board's own name */

static uint32_t stir(uint32_t with)
{
    chance ^= with;
    chance ^= chance << 13;
    chance ^= chance >> 17;
    chance ^= chance << 5;
    if (chance == 0)
        chance = 1;
    return chance;
}

/* A board without a name takes one when it is first asked: when that was, to a tick, nobody can
 * foresee, and what its memory held at power-up is no other chip's. */
static const uint8_t *name_board(uint8_t record[NAME_RECORD])
{
    board_name(record);
    if (!name_in(record)) {
        put32(record + 2, stir(ticks_now()));
        put32(record + 6, stir(ticks_now() ^ events_crc(BOARD_CAPACITY / 4)));
        name_seal(record);
        board_rename(record);
    }
    return name_in(record);
}

/* -- what goes on */

/* At once, also while the line takes nothing: on USB that is for as long as nobody reads. */
static void disarm(uint8_t reason)
{
    board_watch(0);
    phase = PHASE_IDLE;
    untold = reason;
}

static RARE void tell_disarmed(void)
{
    send_begin(MSG_DISARMED, 0);
    send32(order.label);
    send8(untold);
    send_end();
    untold = 0;
}

static void end_recording(void)
{
    board_watch(0);
    release_done();
    closing = true;
}

/* All entries are events and all events are sent: the certificate, and the drop is held. */
static RARE void close_recording(void)
{
    drop.events = events.count;
    drop.crc32 = ~events.crc;
    drop.overflows = board_entries_lost();
    drop.glitches = events.glitches;
    drop.late = events.late;
    drop.pulse_ticks = release_lasted(&drop.pulse_end);
    drop.restarts = restarts.causes;
    drop.lowest_mv = board_supply_mv(supply.worst);
    drop_seal();
    closing = false;
    phase = PHASE_HOLDING;
    drop_certify(0);
}

/* One event goes into the frame at a time, so that no turn of the main loop is long. */
static void stream(void)
{
    uint16_t unsent = (uint16_t)(events.count - events.sent);
    if (room == 0) {
        if (!send_idle())
            return;
        if (unsent == 0) {
            if (closing && events_settled())
                close_recording();
            return;
        }
        /* The first may be younger than `lately`. */
        if (!closing && unsent < BATCH &&
            (int32_t)(lately - get32(events.unsent)) < (int32_t)COMPANY_TICKS)
            return;
        send_begin(MSG_EVENTS, 0);
        send32(drop.label);
        send16(events.sent);
        room = (uint8_t)(unsent < BATCH ? unsent : BATCH);
    } else {
        send_bytes(events.unsent, EVENT_SIZE);
        events_sent_one();
        if (--room == 0) {
            send_end();
            events_free_sent();
        }
    }
}

static void watch_armed(uint32_t now)
{
    order.moved |= events_moved(&order.flicker);
    if (stop.open)
        disarm(DISARM_REASON_STOPPED);
    else if (now - order.since >= order.timeout)
        disarm(DISARM_REASON_TIMEOUT);
    else if (now - order.heard >= (uint32_t)HOST_SILENCE_MS * TICKS_PER_MS)
        disarm(DISARM_REASON_HOST_SILENT);
}

static void watch_recording(uint32_t now)
{
    uint16_t count;
    if (stop.open)
        release_off(PULSE_END_STOPPED);
    if (!drop.sensed && board_sensed(&count)) {
        drop.sensed = 1;
        drop.sense_tick = ticks_of(count);
    }
    if (!closing && now - drop.fire_tick >= order.record_ms * (uint32_t)TICKS_PER_MS)
        end_recording();
}

/* -- requests */

static void identify(void)
{
    uint8_t record[NAME_RECORD], n;
    const uint8_t *name;
    if (request.payload[IDENTIFY_PROTOCOL_VERSION] != PROTOCOL_VERSION) {
        refuse(REASON_VERSION, PROTOCOL_VERSION);
        return;
    }
    name = name_board(record);
    note_restarts(0);
    send_begin(MSG_IDENTITY, request.seq);
    send8(PROTOCOL_VERSION);
    send_text(board_type, sizeof board_type - 1);
    send_text(firmware, sizeof firmware - 1);
    for (n = 0; n < NAME_SIZE; n++)
        send8(name[n]);
    send32(BOARD_HZ);
    send8(BOARD_GATES);
    send8(BOARD_RELEASES);
    send32(RELEASE_MAX_US);
    send16(BOARD_STREAMS ? BOARD_CAPACITY - 1 : BOARD_CAPACITY);
    send8(BOARD_STREAMS);
    send16(BOARD_LATE);
    send_text(board_channels, sizeof board_channels - 1);
    send_end();
}

static void status(void)
{
    bool recorded = phase >= PHASE_RECORDING;
    send_begin(MSG_STATE, request.seq);
    send8(phase);
    send16(board_gates());
    send32(phase == PHASE_ARMED ? order.label : recorded ? drop.label : 0);
    send16(recorded ? events.count : 0);
    send_end();
}

static void arm(void)
{
    const uint8_t *asked = request.payload;
    uint32_t label = get32(asked + ARM_LABEL), pulse_us = get32(asked + ARM_PULSE_US);
    uint16_t gates = get16(asked + ARM_GATES), timeout_ms = get16(asked + ARM_TIMEOUT_MS);
    uint16_t record_ms = get16(asked + ARM_RECORD_MS), blocked, rest_ms;
    uint8_t release = asked[ARM_RELEASE];
    uint32_t now = ticks_now();
    if (phase == PHASE_RECORDING) {
        refuse(REASON_BUSY, 0);
    } else if (phase == PHASE_HOLDING && !(aborted && drop.label == label)) {
        refuse(REASON_HOLDING_A_DROP, (uint16_t)drop.label);
    } else if (label == 0 || gates == 0 || gates & (uint16_t)~BOARD_GATE_MASK ||
               release >> BOARD_RELEASES || pulse_us > RELEASE_MAX_US ||
               (release == 0) != (pulse_us == 0) || timeout_ms == 0 || record_ms == 0) {
        refuse(REASON_BAD_PARAMETER, 0);
    } else if (stop.open) {
        refuse(REASON_STOPPED, 0);
    } else if (release && (rest_ms = release_rest_ms(now)) != 0) {
        refuse(REASON_COOLING, rest_ms);
    } else if ((blocked = board_gates() & gates) != 0) {
        refuse(REASON_GATE_BLOCKED, blocked);
    } else {
        drop_forget();
        order.label = label;
        order.gates = gates;
        order.release = release;
        order.pulse_us = pulse_us;
        order.record_ms = record_ms;
        order.since = order.heard = now;
        order.timeout = timeout_ms * (uint32_t)TICKS_PER_MS;
        order.token = stir(now);
        order.moved = 0;
        order.flicker = false;
        board_watch(0);
        events_start(gates);
        board_watch(gates);
        phase = PHASE_ARMED;
        answer(MSG_ARMED, ARMED_SIZE, order.token);
    }
}

/* Nothing is on outside of a recording. */
static uint32_t pulse_ticks(void)
{
    uint32_t pulse = order.pulse_us * TICKS_PER_US, record = order.record_ms * (uint32_t)TICKS_PER_MS;
    return pulse < record ? pulse : record;
}

static void fire(void)
{
    uint16_t blocked;
    if (phase != PHASE_ARMED) {
        refuse(REASON_NOT_ARMED, 0);
        return;
    }
    order.moved |= events_moved(&order.flicker);
    if (get32(request.payload + FIRE_TOKEN) != order.token) {
        refuse(REASON_WRONG_TOKEN, 0);
    } else if (stop.open) {
        refuse(REASON_STOPPED, 0);
    } else if ((blocked = board_gates() & order.gates) != 0) {
        refuse(REASON_GATE_BLOCKED, blocked);
    } else if (order.moved || order.flicker) {
        refuse(REASON_GATE_UNSTEADY, order.moved);
    } else {
        drop.label = order.label;
        drop.gates = order.gates;
        drop.sensed = 0;
        drop.sense_tick = 0;
        drop.supply_mv = board_supply_mv(supply.now);
        supply.worst = supply.now;
        aborted = closing = false;
        phase = PHASE_RECORDING;
        board_sense_begin();
        drop.fire_tick = release_fire(order.release, pulse_ticks());
        answer(MSG_FIRED, FIRED_SIZE, drop.fire_tick);
    }
}

static void abort_all(void)
{
    if (phase == PHASE_ARMED) {
        board_watch(0);
        phase = PHASE_IDLE;
    }
    release_off(PULSE_END_ABORTED);
    aborted = true;
    if (phase == PHASE_RECORDING && !closing)
        end_recording();
    done();
}

/* Whether the drop of that label is held; refuses if it is not. */
static bool held(uint32_t label)
{
    if (phase == PHASE_RECORDING)
        refuse(REASON_BUSY, 0);
    else if (phase != PHASE_HOLDING || drop.label != label)
        refuse(REASON_NO_SUCH_DROP, 0);
    else
        return true;
    return false;
}

static void read(void)
{
    const uint8_t *asked = request.payload;
    uint16_t first = get16(asked + READ_FIRST);
    uint8_t count = asked[READ_COUNT];
    if (!held(get32(asked + READ_LABEL)))
        return;
    if (count > BATCH)
        count = BATCH;
    if (count == 0) {
        drop_certify(request.seq);
    } else if (first >= drop.events) {
        refuse(REASON_BAD_PARAMETER, 0);
    } else if (first < events_first_kept()) {
        refuse(REASON_NOT_KEPT, events_first_kept());
    } else {
        uint16_t left = (uint16_t)(drop.events - first);
        send_events(first, (uint16_t)(first + (count < left ? count : left)), request.seq);
    }
}

static void acknowledge(void)
{
    if (!held(get32(request.payload + ACKNOWLEDGE_LABEL)))
        return;
    if (get32(request.payload + ACKNOWLEDGE_CRC32) != drop.crc32) {
        refuse(REASON_WRONG_CRC, 0);
        return;
    }
    drop_forget();
    phase = PHASE_IDLE;
    done();
}

static void pong(void)
{
    answer(MSG_PONG, PONG_SIZE, ticks_now());
}

#ifdef BOARD_BOOTS
static void flash(void)
{
    if (phase == PHASE_HOLDING) {
        refuse(REASON_HOLDING_A_DROP, (uint16_t)drop.label);
    } else if (phase != PHASE_IDLE) {
        refuse(REASON_BUSY, 0);
    } else {
        leaving = true;
        done();
    }
}
#endif

static uint16_t pulses;
static uint32_t pulse_tick;

static void reference(void)
{
    send_begin(MSG_REFERENCE_PULSE, request.seq);
    send16(pulses);
    send32(pulse_tick);
    send_end();
}

static RARE void execute(void)
{
    static const struct {
        uint8_t size;
        void (*handle)(void);
    } table[] = {
        [MSG_IDENTIFY] = {IDENTIFY_SIZE, identify}, [MSG_PING] = {PING_SIZE, pong},
        [MSG_STATUS] = {STATUS_SIZE, status},       [MSG_ARM] = {ARM_SIZE, arm},
        [MSG_FIRE] = {FIRE_SIZE, fire},             [MSG_ABORT] = {ABORT_SIZE, abort_all},
        [MSG_READ] = {READ_SIZE, read},             [MSG_ACKNOWLEDGE] = {ACKNOWLEDGE_SIZE, acknowledge},
        [MSG_REFERENCE] = {REFERENCE_SIZE, reference},
#ifdef BOARD_BOOTS
        [MSG_FLASH] = {FLASH_SIZE, flash},
#endif
    };
    bool repeated = last.seq == request.seq && last.type == request.type && last.crc == request.crc;
    if (request.seq == 0)
        return; /* could not be answered */
    order.heard = ticks_now();
    stir(order.heard);
    if (repeated && last.code) {
        answer_again();
        return;
    }
    leaving = false;
    last.seq = request.seq;
    last.type = request.type;
    last.crc = request.crc;
    last.code = 0; /* until the handler leaves an answer that must be repeated */
    if (request.type == 0 || request.type >= sizeof table / sizeof table[0])
        refuse(REASON_UNKNOWN_MESSAGE, request.type);
    else if (request.size != table[request.type].size)
        refuse(REASON_BAD_PARAMETER, 0);
    else
        table[request.type].handle();
}

/* -- the main loop */

/* A spike on a long wire is no emergency: what counts is what every look has seen for a while. */
static void watch_stop(void)
{
    uint32_t now;
    if (board_stopped() == stop.open) {
        stop.wavers = false;
        return;
    }
    now = ticks_roughly();
    if (!stop.wavers) {
        stop.wavers = true;
        stop.since = now;
    } else if ((int32_t)(now - stop.since) >= (int32_t)STOP_TICKS) {
        stop.open = !stop.open;
        stop.wavers = false;
    }
}

static RARE void seldom(uint32_t now)
{
    uint16_t count, measured = board_supply();
    if (measured)
        supply.now = measured;
    if (measured > supply.worst)
        supply.worst = measured;
    board_kick();
    release_pass(now);
    receive_pass();
    if (phase == PHASE_ARMED)
        watch_armed(now);
    else if (phase == PHASE_RECORDING)
        watch_recording(now);
    if (untold && send_idle())
        tell_disarmed();
    if (board_reference(&count)) {
        pulses++;
        pulse_tick = ticks_of(count);
    }
    board_led(phase == PHASE_HOLDING ? now >> 22 & 1 : phase != PHASE_IDLE);
}

void device_pass(void)
{
    static uint8_t turn;
    if (requested)
        receive_pass();
    else
        requested = receive_request(&request);
    if (requested && send_idle()) {
        if (untold) { /* before the answer to what came too late */
            tell_disarmed();
        } else {
            requested = false;
            execute();
        }
    }
    if (phase == PHASE_RECORDING) {
        uint8_t n = BOARD_STEPS;
        while (events_pass() && --n)
            ;
        receive_pass();
        send_pass();
        n = BOARD_STEPS;
        do
            stream();
        while (--n && room);
    }
    send_pass();
    ticks_pass();
    if (release_on()) {
        release_pass(ticks_roughly());
        receive_pass();
    }
    watch_stop();
    board_resume();
#ifdef BOARD_BOOTS
    if (leaving && send_idle())
        board_boot();
#endif
    if (++turn % SELDOM == 0) {
        lately = ticks_roughly();
        seldom(lately);
    }
}

void device_start(uint8_t cause)
{
    static const uint8_t delimiter;
    ticks_start(0);
    release_reset();
    receive_reset();
    send_reset();
    requested = closing = aborted = leaving = false;
    untold = 0;
    stop.open = board_stopped();
    stop.wavers = false;
    if (cause & POWER_ON || (restarts.check ^ restarts.causes) != 0xFF)
        restarts.causes = 0;
    note_restarts((uint8_t)(restarts.causes | RESTARTED | cause));
    last.seq = 0;
    pulses = 0;
    room = 0;
    lately = ticks_now();
    board_watch(0);
    phase = drop_recover() ? PHASE_HOLDING : PHASE_IDLE;
    stir(ticks_now() ^ drop.fire_tick);
    while (!board_send(&delimiter, 1)) /* the reset may have cut a frame short */
        ;
    send_begin(MSG_BOOT, 0);
    send8(cause);
    send_end();
}
