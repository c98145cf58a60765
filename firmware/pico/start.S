/* Vectors, and the way to `main`: everything is copied to RAM and runs there, where no wait for the
 * flash makes a turn of the loop longer than another. */
#include "vectors.h"

    .syntax unified
    .thumb

    .macro VECTORS
    .word stack_end
    .word start
    .rept 14
    .word failed
    .endr
    .word timer_interrupt       /* 0 */
    .rept USB_VECTOR - 1
    .word failed
    .endr
    .word usb_interrupt
    .rept VECTOR_COUNT - USB_VECTOR - 1
    .word failed
    .endr
    .endm

    .section .start_vectors, "a"
    VECTORS
    IMAGE_BLOCK
    .section .ram_vectors, "a"
    VECTORS

    .section .start, "ax"
    .thumb_func
    .global start
start:
    NO_STACK_LIMIT
    ldr  r0, =load_from
    ldr  r1, =load_to
    ldr  r2, =load_end
1:  cmp  r1, r2
    bhs  2f
    ldmia r0!, {r3}
    stmia r1!, {r3}
    b    1b
2:  ldr  r2, =zero_end
    movs r3, #0
3:  cmp  r1, r2
    bhs  4f
    stmia r1!, {r3}
    b    3b
4:  ldr  r0, =load_to           /* the vectors in RAM come first there */
    ldr  r1, =0xE000ED08
    str  r0, [r1]
    ldr  r0, =main
    bx   r0
    .ltorg

    .text
    .thumb_func
failed:                         /* the watchdog restarts the board */
    b    failed
