/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Arrays that grow at the end, sometimes in the middle, and are emptied from the front.
 */
#include "inside.h"

void *queue_at(const queue_t *q, uint32_t i, size_t size) { return q->items + i * size; }

void queue_insert(queue_t *q, uint32_t at, const void *item, size_t size)
{
    if (q->first == q->end)
        at = q->first = q->end = 0;
    if (q->end == q->room) {
        q->room = q->room ? 2 * q->room : 64;
        q->items = realloc(q->items, q->room * size);
        if (!q->items)
            abort();
    }
    memmove(queue_at(q, at + 1, size), queue_at(q, at, size), (q->end - at) * size);
    memcpy(queue_at(q, at, size), item, size);
    q->end++;
}

uint32_t queue_take(queue_t *q, void *to, uint32_t room, size_t size)
{
    uint32_t n = q->end - q->first;
    if (n > room)
        n = room;
    if (n)
        memcpy(to, queue_at(q, q->first, size), n * size);
    q->first += n;
    return n;
}
