/* USB: a serial port (CDC ACM) of packets, without interrupts. */
#ifndef USB_H
#define USB_H

#include <stdbool.h>
#include <stdint.h>

/* `number` is the board's own, which becomes its serial number. */
void usb_start(const uint8_t number[8]);

/* Answer the host; and send what waits, if the bytes of a frame are all there (`whole`). */
void usb_pass(uint8_t whole);

/* The host has taken all that was sent, or nobody listens. */
bool usb_taken(void);

/* The chip is one of those that some hosts never see (erratum RP2040-E5: the oldest, B0 and B1, may
 * miss the end of a bus reset behind a hub), and none has seen it yet. */
bool usb_unseen(void);

#endif
