/* What start.S has of the RP2350: vectors, a block by which the chip's own program knows an image
 * (data sheet, 5.9), and a limit of the stack that this program may have left. */
#define USB_VECTOR 14
#define VECTOR_COUNT 52

    .macro IMAGE_BLOCK
    .word 0xFFFFDED3
    .byte 0x42, 1               /* an item of one word: the image is */
    .hword 0x1021               /* a program, secure, for Arm, for the RP2350 */
    .byte 0xFF                  /* the last item: so many words there were */
    .hword 1
    .byte 0
    .word 0                     /* the only block */
    .word 0xAB123579
    .endm

    .macro NO_STACK_LIMIT
    movs r0, #0
    msr  msplim, r0
    .endm
