#include "clocks.h"

#include "board.h"
#include "chip.h"
#include "registers.h"

#define CRYSTAL_MHZ 12u
#define XOSC_ON (0xFABu << 12 | 0xAA0u) /* 1 to 15 MHz */
/* In 256 of its clocks: 64 ms. The Pico's own crystal needs 1 ms; those of other boards with this
 * chip have needed up to 64 times as long (PICO_XOSC_STARTUP_DELAY_MULTIPLIER of their SDK). */
#define XOSC_WAIT (64u * 47u)
#define STABLE (1u << 31)
#define LOCKED (1u << 31)

/* Registers of a PLL, from its first one. */
#define PLL_CS(pll) (pll)
#define PLL_OFF(pll) ((pll) + 4u)
#define PLL_TIMES(pll) ((pll) + 8u)
#define PLL_DIVIDERS(pll) ((pll) + 12u)
#define PLL_OFF_ITSELF (1u << 0 | 1u << 5)
#define PLL_OFF_DIVIDERS (1u << 3)
#define PLL_MULTIPLIER 100u /* 1200 MHz: the loop may make 750 to 1600 */

_Static_assert(CRYSTAL_MHZ * 1000000u * PLL_MULTIPLIER / (5 * 2) == CLOCK_HZ, "dividers");

void blocks_start(uint32_t which)
{
    TO_CLEAR(RESETS_RESET) = which;
    while (~REGISTER(RESETS_DONE) & which)
        ;
}

static void pll_start(uint32_t pll, uint32_t divider_1, uint32_t divider_2)
{
    REGISTER(PLL_CS(pll)) = 1;
    REGISTER(PLL_TIMES(pll)) = PLL_MULTIPLIER;
    TO_CLEAR(PLL_OFF(pll)) = PLL_OFF_ITSELF;
    while (!(REGISTER(PLL_CS(pll)) & LOCKED))
        ;
    REGISTER(PLL_DIVIDERS(pll)) = divider_1 << 16 | divider_2 << 12;
    TO_CLEAR(PLL_OFF(pll)) = PLL_OFF_DIVIDERS;
}

void clocks_start(void)
{
    REGISTER(XOSC_STARTUP) = XOSC_WAIT;
    REGISTER(XOSC_CTRL) = XOSC_ON;
    while (!(REGISTER(XOSC_STATUS) & STABLE))
        ;
    REGISTER(CLK_REF_CTRL) = 2; /* the crystal */
    while (REGISTER(CLK_REF_SELECTED) != 1u << 2)
        ;
    blocks_start(RESET_PLL_SYS | RESET_PLL_USB);
    pll_start(PLL_SYS, 5, 2);
    pll_start(PLL_USB, 5, 5);
    REGISTER(CLK_SYS_CTRL) = 1; /* the first PLL */
    while (REGISTER(CLK_SYS_SELECTED) != 1u << 1)
        ;
    REGISTER(CLK_USB_CTRL) = CLK_ENABLE; /* the other one */
    REGISTER(CLK_ADC_CTRL) = CLK_ENABLE;
    chip_ticks(CRYSTAL_MHZ);
    blocks_start(RESET_TIMER);
}
