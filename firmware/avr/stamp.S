; The gates' interrupt: stamp, look at both ports, write six bytes, go.
;
; An entry: counter (2), published half of the counter's range (1), which port woke us (1), both
; ports (2). The stamp is taken as early as can be, and everything else is as short as can be: an
; edge that comes while this runs waits for its end.
;
; Registers that nobody else uses: r2 scratch, r3 and r4 the ports, r5 SREG, r6 and r7 hold 0 and 1,
; r9:r8 saves Z, r11:r10 the next entry's place, r13:r12 the place that must not be written.

#include "board.h"

#define MEMORY_END (events_memory + BOARD_CAPACITY * 6)

.macro STAMP vector, port
.global \vector
\vector:
    lds  r2, _SFR_MEM_ADDR(BOARD_COUNTER_LOW)   ; latches the high byte too
    BOARD_LOAD_PORT_0 r3
    BOARD_LOAD_PORT_1 r4
    in   r5, _SFR_IO_ADDR(SREG)
    movw r8, r30
    movw r30, r10
    cp   r30, r12
    cpc  r31, r13
    breq 2f
    st   Z+, r2
    lds  r2, _SFR_MEM_ADDR(BOARD_COUNTER_HIGH)
    st   Z+, r2
    in   r2, _SFR_IO_ADDR(GPIOR0)
    st   Z+, r2
    st   Z+, \port
    st   Z+, r3
    st   Z+, r4
#if BOARD_STREAMS
    cpi  r30, lo8(MEMORY_END)
    brne 1f
    cpi  r31, hi8(MEMORY_END)
    brne 1f
    ldi  r30, lo8(events_memory)
    ldi  r31, hi8(events_memory)
1:
#endif
    movw r10, r30
3:
    movw r30, r8
    out  _SFR_IO_ADDR(SREG), r5
    reti
2:  ; no memory: count it, and stay at 65535. No interrupt before the main loop's next turn, or gates
    ; that toggle without end would leave it no time for anything.
    sts  _SFR_MEM_ADDR(PCICR), r6
    lds  r30, entries_lost
    lds  r31, entries_lost + 1
    adiw r30, 1
    breq 3b
    sts  entries_lost, r30
    sts  entries_lost + 1, r31
    rjmp 3b
.endm

.text
    STAMP BOARD_VECTOR_0, r6
    STAMP BOARD_VECTOR_1, r7
