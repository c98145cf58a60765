/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Interrupts and their flags.
 */
#include "inside.h"

#define FIRST_FLAG_REGISTER 0x35 /* TIFR0 ... TIFR5, PCIFR, EIFR, on both controllers */
#define LAST_FLAG_REGISTER 0x3C

static void spend(avr_t *avr, uint32_t cycles)
{
    avr->cycle += cycles;
    avr->run_cycle_count = avr->run_cycle_count > cycles ? avr->run_cycle_count - cycles : 1;
}

static void entered_or_left(struct avr_irq_t *irq, uint32_t entered, void *param)
{
    entry_t *e = param;
    avr_t *avr = e->board->avr;
    (void)irq;
    if (entered) {
        spend(avr, e->board->entry_cycles); /* defect: entry takes no time */
        return;
    }
    if (avr->interrupt_state == -2)
        avr->interrupt_state = -1; /* defect: two instructions run before the next one, not one */
    if (e->vector->raise_sticky && avr_regbit_get(avr, e->vector->raised))
        avr_raise_interrupt(avr, e->vector); /* its condition still holds */
}

/* Defect: a write to TIFRn clears all flags of that timer, one to PCIFR or EIFR none. */
static void clear_flags(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param)
{
    const uint8_t *code = avr->flash + avr->pc;
    (void)param;
    if (code[1] == 0x9A) /* SBI, which simavr does as read, or, write */
        value = (uint8_t)(1u << (code[0] & 7));
    for (int i = 0; i < avr->interrupts.vector_count; i++) {
        avr_int_vector_t *v = avr->interrupts.vector[i];
        if (v->raised.reg == address && value >> v->raised.bit & 1)
            avr_clear_interrupt(avr, v);
    }
}

void mend_interrupts(board_t *b)
{
    avr_t *avr = b->avr;
    avr_ioport_t *k = b->ports['K' - 'A'].io;
    if (k && !k->r_pcint) { /* defect: the 2560's port K has no pin change interrupt */
        k->r_pcint = 0x6D;
        k->pcint.vector = 11;
        k->pcint.enable = (avr_regbit_t)AVR_IO_REGBIT(0x68, 2);
        k->pcint.raised = (avr_regbit_t)AVR_IO_REGBIT(0x3B, 2);
        avr_register_vector(avr, &k->pcint);
    }
    b->entry_cycles = avr->address_size == 3 ? 5 : 4; /* data sheets, "Interrupt Response Time" */
    for (int i = 0; i < avr->interrupts.vector_count; i++) {
        avr_int_vector_t *v = avr->interrupts.vector[i];
        b->entries[i] = (entry_t){b, v};
        avr_irq_register_notify(v->irq + AVR_INT_IRQ_RUNNING, entered_or_left, &b->entries[i]);
        if (v->raised.reg >= FIRST_FLAG_REGISTER && v->raised.reg <= LAST_FLAG_REGISTER)
            avr->io[AVR_DATA_TO_IO(v->raised.reg)].w.c = clear_flags;
    }
}
