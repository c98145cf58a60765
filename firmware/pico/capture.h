/* The state machines that stamp: one the gates, one all other pins, counting in step. */
#ifndef CAPTURE_H
#define CAPTURE_H

/* Begin, with the counter at 0; the pins are set up already. */
void capture_start(void);

/* Read what the other pins did since the last time. */
void capture_pass(void);

#endif
