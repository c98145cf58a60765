/* The first 256 bytes of flash, which the chip's own boot program copies and calls if their check
 * is right (image.py adds it): have flash readable as memory in the way that every chip knows
 * (command 03h, one bit at a time; fast enough to be copied once), then go to the vectors. */
    .cpu cortex-m0plus
    .syntax unified
    .thumb
    .section .boot2, "ax"

    ldr  r3, =0x18000000        /* SSI */
    movs r1, #0
    str  r1, [r3, #0x08]        /* SSIENR: off */
    movs r1, #4
    str  r1, [r3, #0x14]        /* BAUDR */
    ldr  r1, =(31 << 16 | 3 << 8)
    str  r1, [r3, #0x00]        /* CTRLR0: words of 32 bits, read after an address */
    movs r1, #0
    str  r1, [r3, #0x04]        /* CTRLR1: one word */
    ldr  r2, =0x180000F4
    ldr  r1, =(0x03 << 24 | 2 << 8 | 6 << 2)
    str  r1, [r2]               /* SPI_CTRLR0: 03h, then 24 bits of address */
    movs r1, #1
    str  r1, [r3, #0x08]        /* SSIENR: on */

    ldr  r0, =0x10000100        /* the vectors */
    ldr  r1, =0xE000ED08        /* VTOR */
    str  r0, [r1]
    ldr  r1, [r0]
    msr  msp, r1
    ldr  r1, [r0, #4]
    bx   r1
    .ltorg
