#include "usb.h"

#include <stdbool.h>

#include "board.h"
#include "clocks.h"
#include "descriptors.h"
#include "frames.h"
#include "registers.h"

/* Where the packets are in the controller's memory. */
#define AT_CONTROL 0x100u
#define AT_NOTICES 0x180u
#define AT_OUT 0x200u
#define AT_IN(n) (0x240u + 0x40u * (n))
#define MEMORY(at) ((volatile uint8_t *)(USB_MEMORY + (at)))

#define BUFFER_FULL (1u << 15)
#define BUFFER_DATA1 (1u << 13)
#define BUFFER_STALL (1u << 11)
#define BUFFER_AVAILABLE (1u << 10)
#define BUFFER_SIZE 0x3FFu
#define FULL (PACKET - 1u) /* a short packet always: the host need not wait for more */

#define ENDPOINT_ON (1u << 31 | 1u << 29)
#define ENDPOINT_BULK (2u << 26)
#define ENDPOINT_INTERRUPT (3u << 26)

#define STATUS_BUS_RESET (1u << 19)
#define STATUS_SETUP (1u << 17)
#define DONE_IN(endpoint) (1u << 2 * (endpoint))
#define DONE_OUT(endpoint) (2u << 2 * (endpoint))

#define SIE_INTERRUPT_EACH (1u << 29)
#define SIE_PULL_UP (1u << 16)

#define UNPLUGGED_US 20000u /* for so long that every hub and host sees it */

/* Requests: type and code. */
#define GET_STATUS 0x8000
#define GET_STATUS_INTERFACE 0x8100
#define GET_STATUS_ENDPOINT 0x8200
#define CLEAR_FEATURE_ENDPOINT 0x0201
#define SET_ADDRESS 0x0005
#define GET_DESCRIPTOR 0x8006
#define GET_CONFIGURATION 0x8008
#define SET_CONFIGURATION 0x0009
#define SET_INTERFACE 0x010B
#define SET_LINE_CODING 0x2120
#define GET_LINE_CODING 0xA121
#define SET_LINES 0x2122
#define SEND_BREAK 0x2123
#define LINE_CODING 7
#define READY 1 /* the host's end of the line is open */

static const uint8_t *number;
static uint8_t address, configured;
static bool unplugged; /* the controller is being restarted */
static uint32_t unplugged_since;
static bool address_waits; /* until its request is answered */
static bool listening;
static uint8_t coding[LINE_CODING] = {0x20, 0xA1, 0x07, 0, 0, 0, 8}; /* 500,000 baud; any will do */
static bool coding_comes;

/* The answer being sent to a control request. */
static struct {
    const uint8_t *next;
    uint16_t left;
    bool data1;
    bool short_end; /* a packet that is not full must tell the host that there is no more */
} control;

static bool out_data1, in_data1, in_flight;
static uint8_t out_at, out_size; /* of the packet being read */

/* Packets to the host: the line takes the first one while others are filled. */
#define PACKETS 4u
static struct {
    uint8_t size[PACKETS];
    uint8_t first, closed; /* the one that goes next, or is on its way; how many take no more bytes */
    volatile uint8_t *at;  /* for the next byte, of so many that fit into the packet which is open */
    uint8_t room;
} packets;

/* Hand a buffer over. The controller runs on another clock, so the last bit is set a little later
 * than the others (data sheet, 4.1.2.5.1). */
static void hand_over(uint32_t buffer, uint32_t what)
{
    REGISTER(buffer) = what;
    __asm__ volatile("nop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop");
    REGISTER(buffer) = what | BUFFER_AVAILABLE;
}

/* Take a buffer back, and tell whether the host was quicker. The oldest chips would keep the order
 * for ever (erratum RP2040-E2). */
static bool withdraw(uint32_t buffer, uint32_t done)
{
    uint8_t patience = 255;
    bool was_done;
    if (!OLDER_THAN_B2) {
        REGISTER(USB_ABORT) = done;
        while (!(REGISTER(USB_ABORT_DONE) & done) && --patience)
            ;
    }
    was_done = REGISTER(USB_BUFFERS) & done;
    if (!was_done)
        REGISTER(buffer) = 0;
    REGISTER(USB_ABORT) = 0;
    REGISTER(USB_ABORT_DONE) = done;
    REGISTER(USB_BUFFERS) = done;
    return was_done;
}

static uint32_t toggled(bool *data1)
{
    uint32_t bit = *data1 ? BUFFER_DATA1 : 0;
    *data1 = !*data1;
    return bit;
}

/* -- control requests */

static void control_send(void)
{
    uint16_t size = control.left < PACKET ? control.left : PACKET, n;
    for (n = 0; n < size; n++)
        MEMORY(AT_CONTROL)[n] = control.next[n];
    control.next += size;
    control.left = (uint16_t)(control.left - size);
    if (size < PACKET)
        control.short_end = false;
    hand_over(USB_IN(0), BUFFER_FULL | toggled(&control.data1) | size);
}

static void control_expect(uint32_t size)
{
    hand_over(USB_OUT(0), BUFFER_DATA1 | size);
}

static void control_answer(const uint8_t *data, uint16_t size, uint16_t asked)
{
    control.next = data;
    control.left = size < asked ? size : asked;
    control.short_end = size < asked;
    if (asked) /* from now on: a host that has it all says so, and we may not know it yet */
        control_expect(0);
    control_send();
}

static void control_accept(void)
{
    control_answer(0, 0, 0);
}

static void control_stall(void)
{
    REGISTER(USB_STALL_ARM) = 3;
    REGISTER(USB_IN(0)) = BUFFER_STALL;
    REGISTER(USB_OUT(0)) = BUFFER_STALL;
}

/* The host may have given up the request before. */
static void control_begin(void)
{
    withdraw(USB_IN(0), DONE_IN(0));
    withdraw(USB_OUT(0), DONE_OUT(0));
    control.left = 0;
    control.data1 = true;
    control.short_end = false;
    address_waits = coding_comes = false;
}

static void bytes_expect(void)
{
    out_at = out_size = 0;
    hand_over(USB_OUT(BYTES), toggled(&out_data1) | PACKET);
}

static uint8_t open_packet(void)
{
    return (uint8_t)((packets.first + packets.closed) % PACKETS);
}

static void packet_open(void)
{
    packets.at = MEMORY(AT_IN(open_packet()));
    packets.room = packets.closed < PACKETS ? FULL : 0;
}

static void packet_close(void)
{
    packets.size[open_packet()] = (uint8_t)(FULL - packets.room);
    packets.closed++;
    packet_open();
}

static void packet_sent(void)
{
    in_flight = false;
    packets.first = (uint8_t)((packets.first + 1u) % PACKETS);
    packets.closed--;
    if (!packets.room)
        packet_open();
}

static void packet_send(void)
{
    REGISTER(USB_IN_CTRL(BYTES)) = ENDPOINT_ON | ENDPOINT_BULK | AT_IN(packets.first);
    hand_over(USB_IN(BYTES), BUFFER_FULL | toggled(&in_data1) | packets.size[packets.first]);
    in_flight = true;
}

static void bytes_received(void)
{
    out_at = 0;
    out_size = (uint8_t)(REGISTER(USB_OUT(BYTES)) & BUFFER_SIZE);
    if (!out_size)
        bytes_expect();
}

/* From now on both sides count packets from DATA0, also the one that is offered already. */
static void out_restart(void)
{
    bool waits = configured && out_at == out_size;
    if (waits && withdraw(USB_OUT(BYTES), DONE_OUT(BYTES))) {
        bytes_received();
        waits = out_at == out_size;
    }
    out_data1 = false;
    if (waits)
        bytes_expect();
}

static void in_restart(void)
{
    if (in_flight && withdraw(USB_IN(BYTES), DONE_IN(BYTES)))
        packet_sent();
    in_flight = false; /* it is offered anew */
    in_data1 = false;
}

/* The host's end of the line is open or not. What nobody has read is lost when it closes; what was
 * sent before it ever opened, BOOT, waits. */
static void listen(bool open)
{
    if (listening && !open) {
        packets.closed = in_flight;
        packet_open();
    }
    listening = open;
}

static void configure(uint8_t value)
{
    configured = value;
    if (!value)
        return;
    REGISTER(USB_IN_CTRL(NOTICES)) = ENDPOINT_ON | ENDPOINT_INTERRUPT | AT_NOTICES;
    REGISTER(USB_IN_CTRL(BYTES)) = ENDPOINT_ON | ENDPOINT_BULK | AT_IN(0);
    REGISTER(USB_OUT_CTRL(BYTES)) = ENDPOINT_ON | ENDPOINT_BULK | AT_OUT;
    out_data1 = in_data1 = false;
    if (in_flight) { /* on a bus that is no more */
        REGISTER(USB_IN(BYTES)) = 0;
        packet_sent();
    }
    bytes_expect();
}

static void setup(void)
{
    static const uint8_t nothing[2];
    volatile uint8_t *packet = MEMORY(0);
    uint16_t request = (uint16_t)(packet[0] << 8 | packet[1]);
    uint16_t value = (uint16_t)(packet[2] | packet[3] << 8);
    uint16_t asked = (uint16_t)(packet[6] | packet[7] << 8), size;
    const uint8_t *found;
    switch (request) {
    case GET_DESCRIPTOR:
        found = descriptor((uint8_t)(value >> 8), (uint8_t)value, number, &size);
        if (found)
            control_answer(found, size, asked);
        else
            control_stall();
        break;
    case SET_ADDRESS:
        address = (uint8_t)(value & 127);
        address_waits = true;
        control_accept();
        break;
    case SET_CONFIGURATION:
        listen(false);
        configure((uint8_t)value);
        control_accept();
        break;
    case GET_CONFIGURATION:
        control_answer(&configured, 1, asked);
        break;
    case GET_STATUS:
    case GET_STATUS_INTERFACE:
    case GET_STATUS_ENDPOINT:
        control_answer(nothing, 2, asked);
        break;
    case GET_LINE_CODING:
        control_answer(coding, LINE_CODING, asked);
        break;
    case SET_LINE_CODING:
        coding_comes = true;
        control_expect(PACKET);
        break;
    case SET_LINES:
        listen(value & READY);
        control_accept();
        break;
    case CLEAR_FEATURE_ENDPOINT:
        if (packet[4] == BYTES)
            out_restart();
        else if (packet[4] == (0x80 | BYTES))
            in_restart();
        control_accept();
        break;
    case SET_INTERFACE:
        if (packet[4] == BYTES_INTERFACE) {
            out_restart();
            in_restart();
        }
        control_accept();
        break;
    case SEND_BREAK:
        control_accept();
        break;
    default:
        control_stall();
    }
}

static void control_sent(void)
{
    if (address_waits) {
        REGISTER(USB_ADDRESS) = address;
        address_waits = false;
    }
    if (control.left || control.short_end)
        control_send();
}

static void control_received(void)
{
    uint8_t n;
    if (!coding_comes)
        return;
    for (n = 0; n < LINE_CODING; n++)
        coding[n] = MEMORY(AT_CONTROL)[n];
    coding_comes = false;
    control_accept();
}

/* -- the line */

bool board_receive(uint8_t *byte)
{
    if (out_at == out_size)
        return false;
    *byte = MEMORY(AT_OUT)[out_at++];
    if (out_at == out_size)
        bytes_expect();
    return true;
}

/* While nobody listens, what comes first stays (it is BOOT), and the rest is lost. */
uint8_t board_send(const uint8_t *bytes, uint8_t count)
{
    const uint8_t *end = bytes + count, *next = bytes;
    while (next != end && packets.room && !unplugged) {
        uint8_t left = (uint8_t)(end - next), n = left < packets.room ? left : packets.room;
        volatile uint8_t *at = packets.at;
        packets.room = (uint8_t)(packets.room - n);
        packets.at += n;
        while (n--)
            *at++ = *next++;
        if (!packets.room)
            packet_close();
    }
    return listening ? (uint8_t)(next - bytes) : count;
}

/* -- the bus */

static void bus_reset(void)
{
    REGISTER(USB_ADDRESS) = 0;
    address_waits = false;
    configure(0);
    listen(false);
    frames_forget();
}

static void controller_start(void)
{
    uint32_t at;
    for (at = 0; at < 0x180; at += 4)
        REGISTER(USB_MEMORY + at) = 0;
    REGISTER(USB_MUXING) = 1u << 0 | 1u << 3; /* to the chip's own transceiver */
    REGISTER(USB_POWER) = 1u << 2 | 1u << 3;  /* plugged in: it has no other supply */
    REGISTER(USB_MAIN_CTRL) = 1;
    REGISTER(USB_SIE_CTRL) = SIE_INTERRUPT_EACH;
    REGISTER(USB_INTE) = 1u << 4 | 1u << 12 | 1u << 16; /* packets, bus reset, requests */
    TO_SET(USB_SIE_CTRL) = SIE_PULL_UP;
    frames_forget();
}

/* The controller hangs: start it anew, and nothing else. To the host somebody has pulled the plug
 * and put it back; a drop goes on, and a held one stays. */
static void unplug(void)
{
    TO_SET(RESETS_RESET) = RESET_USB;
    unplugged = true;
    unplugged_since = REGISTER(TIMER_RAW_LOW);
    configured = address_waits = false;
    listen(false);
    if (in_flight)
        packet_sent();
    out_at = out_size = 0;
}

/* It may take its time: nothing waits for it. */
static void plug_in(void)
{
    if (REGISTER(TIMER_RAW_LOW) - unplugged_since < UNPLUGGED_US)
        return;
    TO_CLEAR(RESETS_RESET) = RESET_USB;
    if (!(REGISTER(RESETS_DONE) & RESET_USB))
        return;
    unplugged = false;
    controller_start();
}

bool usb_taken(void)
{
    return !listening || (!packets.closed && packets.room == FULL);
}

bool usb_unseen(void)
{
    return OLDER_THAN_B2 && !configured;
}

void usb_pass(uint8_t whole)
{
    uint32_t status, done;
    if (unplugged) {
        plug_in();
        return;
    }
    frames_pass();
    if (frames_ended()) {
        unplug();
        return;
    }
    /* In this order: what was done before a request is known when we see that. */
    status = REGISTER(USB_SIE_STATUS);
    done = REGISTER(USB_BUFFERS);
    if (done)
        REGISTER(USB_BUFFERS) = done;
    if (status & STATUS_BUS_RESET) {
        REGISTER(USB_SIE_STATUS) = STATUS_BUS_RESET;
        bus_reset();
    }
    if (done & DONE_IN(0))
        control_sent();
    if (done & DONE_OUT(0))
        control_received();
    if (done & DONE_IN(BYTES))
        packet_sent();
    if (done & DONE_OUT(BYTES))
        bytes_received();
    if (status & STATUS_SETUP) {
        control_begin(); /* first: the host is put off until its request is taken */
        REGISTER(USB_SIE_STATUS) = STATUS_SETUP;
        setup();
    }
    if (!configured || !listening || in_flight)
        return;
    if (whole && !packets.closed && packets.room < FULL)
        packet_close();
    /* At a frame's end a hub may cut a packet off, and the controller would hang for ever (RP2040-E15). */
    if (packets.closed && frames_early())
        packet_send();
}

void usb_start(const uint8_t own[8])
{
    number = own;
    packet_open();
    blocks_start(RESET_USB);
    controller_start();
}
