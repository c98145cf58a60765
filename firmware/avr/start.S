; Before anything else: keep the cause of the reset, and stop the watchdog, which a watchdog reset
; leaves on at its shortest time.

#include <avr/io.h>

.section .init3, "ax", @progbits
    in   r24, _SFR_IO_ADDR(MCUSR)
    sts  reset_cause, r24
    out  _SFR_IO_ADDR(MCUSR), r1
    wdr
    ldi  r24, _BV(WDCE) | _BV(WDE)
    sts  _SFR_MEM_ADDR(WDTCSR), r24
    sts  _SFR_MEM_ADDR(WDTCSR), r1
