#include "descriptors.h"

#include "board.h"
#include "registers.h"

/* The maker's number for a CDC port of the RP2040; other chips of this firmware use it too. */
#define VENDOR 0x2E8A
#define PRODUCT 0x000A

#define LOW(word) ((word) & 0xFF)
#define HIGH(word) ((word) >> 8)

#define DEVICE 1
#define CONFIGURATION 2
#define TEXT 3

static const uint8_t device[] = {
    18, DEVICE, 0x00, 0x02,  /* USB 2.0 */
    2, 2, 0,                 /* communications, ACM: Windows chooses its driver by both */
    PACKET,
    LOW(VENDOR), HIGH(VENDOR), LOW(PRODUCT), HIGH(PRODUCT), 0x00, 0x01,
    1, 2, 3,                 /* texts: maker, product, serial number */
    1,
};

#define ALL 67
static const uint8_t configuration[ALL] = {
    9, CONFIGURATION, ALL, 0, 2, 1, 0, 0x80, 250 / 2, /* from the bus, 250 mA */
    /* the line's control: CDC, ACM */
    9, 4, 0, 0, 1, 2, 2, 0, 0,
    5, 0x24, 0, 0x10, 0x01,
    5, 0x24, 1, 0, 1,
    4, 0x24, 2, 2,
    5, 0x24, 6, 0, 1,
    7, 5, 0x80 | NOTICES, 3, 8, 0, 255,
    /* its bytes */
    9, 4, BYTES_INTERFACE, 0, 2, 10, 0, 0, 0,
    7, 5, BYTES, 2, PACKET, 0, 0,
    7, 5, 0x80 | BYTES, 2, PACKET, 0, 0,
};

static uint8_t text[2 + 2 * 36];

static void add(char letter)
{
    text[text[0]++] = (uint8_t)letter;
    text[text[0]++] = 0;
}

const uint8_t *descriptor(uint8_t type, uint8_t index, const uint8_t number[8], uint16_t *size)
{
    /* The oldest chips may not be seen behind a hub (RP2040-E5). */
    const char *const texts[] = {
        0, "chainrig",
        OLDER_THAN_B2 ? "chainrig on a Pico B1 (use no hub)" : "chainrig on a Pico" BOARD_SUFFIX};
    uint8_t n;
    if (type == DEVICE) {
        *size = sizeof device;
        return device;
    }
    if (type == CONFIGURATION) {
        *size = sizeof configuration;
        return configuration;
    }
    if (type != TEXT || index > 3)
        return 0;
    text[0] = 2;
    text[1] = TEXT;
    if (index == 0) {
        text[0] = 4;
        text[2] = 0x09; /* English */
        text[3] = 0x04;
    } else if (index == 3) {
        for (n = 0; n < 16; n++)
            add("0123456789ABCDEF"[number[n / 2] >> (n % 2 ? 0 : 4) & 15]);
    } else {
        const char *letter = texts[index];
        while (*letter)
            add(*letter++);
    }
    *size = text[0];
    return text;
}
