/* The board's own name, which it gives itself once: a record with a mark and a check, so that neither
 * an empty memory nor a damaged one is taken for a name. */
#ifndef NAME_H
#define NAME_H

#include <stdint.h>

#define NAME_SIZE 8
#define NAME_RECORD (2 + NAME_SIZE + 2) /* the mark, the name, CRC-16 over both */

/* Where the name begins in the record, or 0 if that is none. */
const uint8_t *name_in(const uint8_t record[NAME_RECORD]);

/* Complete a record that has its name in its place. */
void name_seal(uint8_t record[NAME_RECORD]);

#endif
