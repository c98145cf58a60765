/* Vectors, a block by which the chip's own program knows an image (data sheet, 5.9), and the way to
 * `main`: everything is copied to RAM and runs there, as on the RP2040. */
    .cpu cortex-m33
    .syntax unified
    .thumb

    .macro VECTORS
    .word stack_end
    .word start
    .rept 14
    .word failed
    .endr
    .word timer_interrupt       /* 0 */
    .rept 13
    .word failed
    .endr
    .word usb_interrupt         /* 14 */
    .rept 37
    .word failed
    .endr
    .endm

    .section .start_vectors, "a"
    VECTORS
    .word 0xFFFFDED3
    .byte 0x42, 1               /* an item of one word: the image is */
    .hword 0x1021               /* a program, secure, for Arm, for the RP2350 */
    .byte 0xFF                  /* the last item: so many words there were */
    .hword 1
    .byte 0
    .word 0                     /* the only block */
    .word 0xAB123579
    .section .ram_vectors, "a"
    VECTORS

    .section .start, "ax"
    .thumb_func
    .global start
start:
    movs r0, #0
    msr  msplim, r0
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
