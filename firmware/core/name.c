#include "name.h"

#include "bytes.h"
#include "checks.h"

#define MARK 0x5243 /* "CR" */
#define NAME 2
#define CHECK (NAME + NAME_SIZE)

static uint16_t check(const uint8_t *record)
{
    uint16_t crc = CRC16_START;
    uint8_t n;
    for (n = 0; n < CHECK; n++)
        crc = crc16_add(crc, record[n]);
    return crc;
}

const uint8_t *name_in(const uint8_t record[NAME_RECORD])
{
    return get16(record) == MARK && get16(record + CHECK) == check(record) ? record + NAME : 0;
}

void name_seal(uint8_t record[NAME_RECORD])
{
    put16(record, MARK);
    put16(record + CHECK, check(record));
}
