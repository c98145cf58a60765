/* What start.S has of the RP2040: vectors, and nothing else. */
#define USB_VECTOR 5
#define VECTOR_COUNT 32

    .macro IMAGE_BLOCK
    .endm

    .macro NO_STACK_LIMIT
    .endm
