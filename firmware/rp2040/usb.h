/* USB: a serial port (CDC ACM) of packets, without interrupts. */
#ifndef USB_H
#define USB_H

#include <stdint.h>

/* `number` is the board's own, which becomes its serial number. */
void usb_start(const uint8_t number[8]);

/* Answer the host; and send what waits, if the bytes of a frame are all there (`whole`). */
void usb_pass(uint8_t whole);

#endif
