#include "programs.h"

#include "pio.h"

/* The loops end at fixed addresses, so each instruction says which one is its own. */
const uint16_t programs[PROGRAM_WORDS] __attribute__((section(".pio"), used)) = {
    /* Capture. Sixteen pins are sampled every six clocks, and OSR counts down by one each time. What
     * was sampled last is in the lower half of ISR and, while nothing changes, in both halves of X. */
    [0] = PIO_IN(PINS, 16),      /* 1 the sample; the one before goes to the upper half */
    [1] = PIO_MOV(Y, ISR),       /* 2 */
    [2] = PIO_JMP_DIFFER(6),     /* 3 */
    [3] = PIO_MOV(Y, OSR),       /* 4 */
    [4] = PIO_JMP_Y_DEC(5),      /* 5 */
    [5] = PIO_MOV(OSR, Y),       /* 6 and round again */
    /* A change takes 18 clocks, so it counts three. */
    [6] = PIO_PUSH,              /* 4 the states before (upper half) and now; ISR is 0 then */
    [7] = PIO_MOV(ISR, OSR),     /* 5 */
    [8] = PIO_PUSH,              /* 6 the count */
    [9] = PIO_IN(Y, 16),         /* 7 */
    [10] = PIO_IN(Y, 16),        /* 8 the state now, twice */
    [11] = PIO_MOV(X, ISR),      /* 9 */
    [12] = PIO_MOV(Y, OSR),      /* 10 */
    [13] = PIO_JMP_Y_DEC(14),    /* 11 */
    [14] = PIO_JMP_Y_DEC(15),    /* 12 */
    [15] = PIO_JMP_Y_DEC(16),    /* 13 */
    [16] = PIO_MOV(OSR, Y),      /* 14 */
    [17] = PIO_DELAY(3, PIO_JMP(0)), /* 15 to 18 */

    /* Release. Two words: ticks less one; then the outputs (lower three bits: both releases and
     * sync) and for how many ticks the emergency stop must be open to end them. */
    [18] = PIO_PULL,
    [19] = PIO_MOV(X, OSR),
    [20] = PIO_PULL,
    [21] = PIO_DELAY(3, PIO_OUT(PINS, 3)), /* all on, in this clock; OSR keeps the rest */
    [22] = PIO_MOV(Y, OSR),
    [23] = PIO_JMP_X_DEC(27), /* the loop: six clocks, whether the stop is open or closed */
    [24] = PIO_SET(PINS, 0),  /* off: a whole number of ticks after they went on */
    [25] = PIO_MOV(ISR, X),   /* how many were left, or all ones */
    [26] = PIO_PUSH,          /* and round again */
    [27] = PIO_JMP_PIN(30),
    [28] = PIO_DELAY(1, PIO_MOV(Y, OSR)), /* closed: its wait begins anew */
    [29] = PIO_DELAY(1, PIO_JMP(23)),
    [30] = PIO_DELAY(3, PIO_JMP_Y_DEC(23)), /* open, but not yet for long enough */
    [31] = PIO_JMP(24),
};
