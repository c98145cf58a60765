#include "release_machine.h"

#include "board.h"
#include "pio.h"
#include "programs.h"
#include "registers.h"

#define ALL_LOW PIO_MOV(PINS, NOTHING)
#define SHIFT_OUT_RIGHT (1u << 19)
#define RX_EMPTY (PIO_RX_EMPTY << RELEASE_MACHINE)
#define OUTPUTS 3u /* OUT moves both releases and sync, SET the releases only */
#define PINS_OF(set) (OUTPUTS << 20 | (set) << 26 | RELEASE_0 << 5 | RELEASE_0)
#define WHOLE 0xFFFFFFFFu

_Static_assert(RELEASE_1 == RELEASE_0 + 1 && SYNC == RELEASE_0 + 2, "pins in a row");

static void at_once(uint32_t instruction)
{
    REGISTER(PIO_INSTR(RELEASE_MACHINE)) = instruction;
}

void release_machine_start(void)
{
    uint32_t pin;
    REGISTER(PIO_CLKDIV(RELEASE_MACHINE)) = 1u << 16;
    REGISTER(PIO_EXECCTRL(RELEASE_MACHINE)) =
        STOP << 24 | RELEASE_WRAP << 12 | RELEASE_START << 7;
    REGISTER(PIO_SHIFTCTRL(RELEASE_MACHINE)) = SHIFT_OUT_RIGHT;
    REGISTER(PIO_PINCTRL(RELEASE_MACHINE)) = PINS_OF(OUTPUTS);
    at_once(ALL_LOW);
    at_once(PIO_SET(DIRECTIONS, 7));
    at_once(PIO_JMP(RELEASE_START));
    REGISTER(PIO_PINCTRL(RELEASE_MACHINE)) = PINS_OF(OUTPUTS - 1);
    for (pin = RELEASE_0; pin <= SYNC; pin++)
        REGISTER(PINS_CTRL(pin)) = FUNCTION_PIO0;
}

static void forget_what_was_left(void)
{
    while (!(REGISTER(PIO_FSTAT) & RX_EMPTY))
        (void)REGISTER(PIO_RX(RELEASE_MACHINE));
}

void release_machine_fire(uint8_t release, uint32_t ticks)
{
    forget_what_was_left();
    REGISTER(PIO_TX(RELEASE_MACHINE)) = ticks - 1;
    REGISTER(PIO_TX(RELEASE_MACHINE)) =
        STOP_OPEN_TICKS << OUTPUTS | 1u << (SYNC - RELEASE_0) | release;
}

void board_release_off(void)
{
    at_once(PIO_JMP(RELEASE_START));
    at_once(PIO_SET(PINS, 0)); /* last: nothing can take its place any more */
}

bool board_release_high(void)
{
    return REGISTER(SIO_IN) & (1u << RELEASE_0 | 1u << RELEASE_1);
}

uint32_t board_release_cut(void)
{
    uint32_t left = WHOLE;
    if (!(REGISTER(PIO_FSTAT) & RX_EMPTY))
        left = REGISTER(PIO_RX(RELEASE_MACHINE));
    return left == WHOLE ? 0 : left;
}

void board_sync(bool on)
{
    if (!on)
        at_once(ALL_LOW); /* with the releases: it is the last to go */
}
