/* Instructions of PIO as words (data sheet, 3.4); `PIO_DELAY(n, ...)` waits n clocks more. */
#ifndef PIO_H
#define PIO_H

#define PIO_JMP(to) (0x0000u | (to))
#define PIO_JMP_X_DEC(to) (0x0040u | (to)) /* if X is not 0; in any case X is one less then */
#define PIO_JMP_Y_DEC(to) (0x0080u | (to))
#define PIO_JMP_DIFFER(to) (0x00A0u | (to)) /* if X and Y differ */
#define PIO_JMP_PIN(to) (0x00C0u | (to))

#define PIO_IN(from, bits) (0x4000u | (from) << 5 | ((bits) & 31u))
#define PIO_OUT(to, bits) (0x6000u | (to) << 5 | ((bits) & 31u))
#define PIO_PUSH 0x8000u /* what finds no room is lost: waiting would lose time */
#define PIO_PULL 0x80A0u /* waits */
#define PIO_MOV(to, from) (0xA000u | (to) << 5 | (from))
#define PIO_MOV_NOT(to, from) (0xA008u | (to) << 5 | (from))
#define PIO_SET(to, value) (0xE000u | (to) << 5 | (value))
#define PIO_DELAY(clocks, instruction) ((instruction) | (clocks) << 8)

#define PINS 0u
#define X 1u
#define Y 2u
#define NOTHING 3u
#define DIRECTIONS 4u /* of SET and OUT only */
#define ISR 6u
#define OSR 7u

#endif
