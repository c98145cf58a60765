/* Raspberry Pi Pico 2: wired as a Pico is. */
#define BOARD_SUFFIX " 2"
#include "../rp2040/board.h"
