/* The frames of the bus: a host begins one each millisecond. They say when a packet may be offered,
 * and whether the controller is alive. */
#ifndef FRAMES_H
#define FRAMES_H

#include <stdbool.h>

/* Nothing is known of the bus: it is reset, or the controller has just been started. */
void frames_forget(void);

/* Look at the controller; called in each turn of the main loop. */
void frames_pass(void);

/* A packet that is offered now is not offered in the last fifth of a frame. */
bool frames_early(void);

/* Frames came, and then no more, though the bus is not suspended. */
bool frames_ended(void);

#endif
