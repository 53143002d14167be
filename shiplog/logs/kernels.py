"""Compiled loops over a block of bytes: MCAP records, protobuf and CDR into columns.

They never raise and never read outside their input: a message that breaks off or contradicts
itself gets `bad[i] = True`. numba keeps the machine code on disk, so only the first run compiles.
"""

from __future__ import annotations

import numpy as np
from numba import njit

MESSAGE_HEAD = 22  # channel, sequence, log time and publish time, before the payload
DEEPEST = 32  # nested protobuf messages; the layout stops long before

DOUBLE, FLOAT, VARINT, ZIGZAG, FIXED32, FIXED64, MESSAGE, TEXT = range(8)
REPEATED = 16  # added to the kind of a repeated number

NUMBER, STRING, NUMBERS, LOOP, END = range(5)  # steps through a CDR message


@njit(cache=True, nogil=True)
def _unsigned(data, at, size):
    value = np.uint64(0)
    for k in range(size):
        value |= np.uint64(data[at + k]) << np.uint64(8 * k)
    return value


@njit(cache=True, nogil=True)
def split(data):
    """The records of a block: messages as arrays, and where schemas and channels are.

    returns channel, log, publish, start, length [n each]; definitions [k, 3] of opcode, start,
    length; and whether the block ended where its last record did.
    """
    most = data.size // 31 + 1
    channel = np.empty(most, np.int32)
    log = np.empty(most, np.int64)
    publish = np.empty(most, np.int64)
    start = np.empty(most, np.int64)
    length = np.empty(most, np.int64)
    defined = np.empty((64, 3), np.int64)
    n, k, at, whole = 0, 0, 0, True
    while at < data.size:
        if at + 9 > data.size:
            whole = False
            break
        opcode = data[at]
        size = _unsigned(data, at + 1, 8)
        at += 9
        if size > np.uint64(data.size - at):
            whole = False
            break
        size = np.int64(size)
        if opcode == 5:
            if size < MESSAGE_HEAD:
                whole = False
                break
            channel[n] = np.int32(_unsigned(data, at, 2))
            log[n] = np.int64(_unsigned(data, at + 6, 8))
            publish[n] = np.int64(_unsigned(data, at + 14, 8))
            start[n] = at + MESSAGE_HEAD
            length[n] = size - MESSAGE_HEAD
            n += 1
        elif opcode == 3 or opcode == 4:
            if k == defined.shape[0]:
                larger = np.empty((2 * k, 3), np.int64)
                larger[:k] = defined
                defined = larger
            defined[k, 0], defined[k, 1], defined[k, 2] = opcode, at, size
            k += 1
        at += size
    return channel[:n], log[:n], publish[:n], start[:n], length[:n], defined[:k], whole


@njit(cache=True, nogil=True)
def _varint(data, at, end):
    """Value and next position; position -1 when it does not end in time."""
    value = np.uint64(0)
    for k in range(10):
        if at + k >= end:
            break
        byte = data[at + k]
        value |= np.uint64(byte & 0x7F) << np.uint64(7 * k)
        if byte < 0x80:
            return value, at + k + 1
    return value, -1


@njit(cache=True, nogil=True)
def _scalar(data, at, end, kind):
    """One number as 64 bits, and the next position or -1."""
    if kind in (VARINT, ZIGZAG):
        value, after = _varint(data, at, end)
        if kind == ZIGZAG:
            value = (value >> np.uint64(1)) ^ (np.uint64(0) - (value & np.uint64(1)))
        return value, after
    size = 4 if kind in (FLOAT, FIXED32) else 8
    if at + size > end:
        return np.uint64(0), -1
    return _unsigned(data, at, size), at + size


@njit(cache=True, nogil=True)
def protobuf(data, start, length, table, bits, extent, seen, present, flat, base, counts, bad):
    """Decode messages by a table of the fields that are wanted; the rest is stepped over.

    table    [fields, 4]  message node, field number, kind, column (or node of a MESSAGE)
    bits     [columns, n] 64 bits of every number
    extent   [columns, n, 2]  where a text begins in `data`, and its length
    seen     [columns, n]     the field was in the message
    present  [nodes, n]       the enclosing message was in the message
    flat     [sum]            values of repeated numbers; column c from base[c]; empty: count only
    counts   [columns, n]     how many values a repeated number has
    bad      [n]      set for what does not decode; what is set already is stepped over, since
                      a second run has room in `flat` only for what the first one counted
    """
    n = start.size
    used = np.zeros(base.size, np.int64)  # values of each repeated number so far
    before = np.zeros(base.size, np.int64)  # and at the start of this message
    filling = flat.size > 0
    nodes = np.empty(DEEPEST, np.int64)
    ends = np.empty(DEEPEST, np.int64)
    for i in range(n):
        if bad[i]:
            continue
        depth = 0
        nodes[0], ends[0] = 0, start[i] + length[i]
        present[0, i] = True
        at = start[i]
        before[:] = used
        while True:
            while depth > 0 and at == ends[depth]:
                depth -= 1
            end = ends[depth]
            if at == end:
                break
            key, at = _varint(data, at, end)
            if at < 0:
                bad[i] = True
                break
            number = np.int64(key >> np.uint64(3))
            wire = np.int64(key & np.uint64(7))
            size = np.int64(0)  # of the value, for the wire types that state or imply it
            value = np.uint64(0)
            after = at
            if wire == 0:
                value, after = _varint(data, at, end)
            elif wire == 1:
                after = at + 8
            elif wire == 5:
                after = at + 4
            elif wire == 2:
                value, at = _varint(data, at, end)
                if at >= 0 and value <= np.uint64(end - at):
                    size = np.int64(value)
                    after = at + size
                else:
                    after = -1
            else:
                after = -1
            if after < 0 or after > end or number == 0:
                bad[i] = True
                break
            for f in range(table.shape[0]):
                if table[f, 0] != nodes[depth] or table[f, 1] != number:
                    continue
                kind, column = table[f, 2], table[f, 3]
                single = kind % REPEATED
                fits = (
                    (wire == 0 and single in (VARINT, ZIGZAG))
                    or (wire == 1 and single in (DOUBLE, FIXED64))
                    or (wire == 5 and single in (FLOAT, FIXED32))
                )
                if kind == MESSAGE and wire == 2:
                    if depth + 1 == DEEPEST:
                        bad[i] = True
                        break
                    depth += 1
                    nodes[depth], ends[depth] = column, after
                    present[column, i] = True
                    after = at
                elif kind == TEXT and wire == 2:
                    extent[column, i, 0], extent[column, i, 1] = at, size
                    seen[column, i] = True
                elif kind < REPEATED and fits:
                    bits[column, i], _ = _scalar(data, at, after, single)
                    seen[column, i] = True
                elif kind >= REPEATED and (fits or wire == 2):
                    while at < after:
                        value, at = _scalar(data, at, after, single)
                        if at < 0:
                            bad[i] = True
                            break
                        if filling:
                            flat[base[column] + used[column]] = value
                        used[column] += 1
                        counts[column, i] = used[column] - before[column]
                break
            if bad[i]:
                break
            at = after
        if bad[i]:
            for c in range(base.size):
                used[c] = before[c]
                counts[c, i] = 0


@njit(cache=True, nogil=True)
def gather(data, start, length):
    """Scattered texts side by side, with the offsets Arrow wants."""
    offsets = np.zeros(start.size + 1, np.int64)
    for i in range(start.size):
        offsets[i + 1] = offsets[i] + length[i]
    packed = np.empty(offsets[-1], np.uint8)
    for i in range(start.size):
        packed[offsets[i] : offsets[i + 1]] = data[start[i] : start[i] + length[i]]
    return packed, offsets


@njit(cache=True, nogil=True)
def digests(data, start, length):
    """64 bits of every payload (FNV-1a by words): equal payloads have equal digests."""
    found = np.empty(start.size, np.uint64)
    for i in range(start.size):
        value = np.uint64(14695981039346656037) ^ np.uint64(length[i])
        at, end = start[i], start[i] + length[i]
        while at < end:
            word = _unsigned(data, at, 8) if at + 8 <= end else _unsigned(data, at, end - at)
            value = (value ^ word) * np.uint64(1099511628211)
            value ^= value >> np.uint64(29)
            at += 8
        found[i] = value
    return found


@njit(cache=True, nogil=True)
def _ordered(data, at, size, big):
    """An unsigned number of either byte order."""
    if not big:
        return _unsigned(data, at, size)
    value = np.uint64(0)
    for k in range(size):
        value = (value << np.uint64(8)) | np.uint64(data[at + k])
    return value


@njit(cache=True, nogil=True)
def cdr(data, start, length, steps, bits, extent, flat, base, counts, bad):
    """Decode messages whose fields follow each other; columns as in `protobuf`.

    steps    [steps, 4]  what comes next, its size (or the step to jump to), column or -1, count
             NUMBER size; STRING; NUMBERS size, count (-1: stated); LOOP end, count; END begin
    bad      [n]      set for what does not decode; what is set already is stepped over, since
                      a second run has room in `flat` only for what the first one counted
    """
    n = start.size
    used = np.zeros(base.size, np.int64)  # values of each repeated number so far
    before = np.zeros(base.size, np.int64)  # and at the start of this message
    filling = flat.size > 0
    left = np.zeros(DEEPEST, np.int64)
    for i in range(n):
        if bad[i]:
            continue
        before[:] = used
        end = start[i] + length[i]
        origin = start[i] + 4  # numbers are aligned from here
        if origin > end:
            bad[i] = True
            continue
        big = data[start[i] + 1] & 1 == 0
        at = origin
        depth = 0
        step = 0
        while step < steps.shape[0]:
            op, size, column, count = steps[step, 0], steps[step, 1], steps[step, 2], steps[step, 3]
            step += 1
            if op == END:
                left[depth] -= 1
                if left[depth] > 0:
                    step = size + 1
                else:
                    depth -= 1
                continue
            if op == STRING or count < 0:  # a count comes first
                at += (origin - at) % 4
                if at + 4 > end:
                    bad[i] = True
                    break
                count = np.int64(_ordered(data, at, 4, big))
                at += 4
            if op == NUMBER:
                at += (origin - at) % size
                if at + size > end:
                    bad[i] = True
                    break
                if column >= 0:
                    bits[column, i] = _ordered(data, at, size, big)
                at += size
            elif op == STRING:
                if count > end - at:
                    bad[i] = True
                    break
                if column >= 0:
                    extent[column, i, 0], extent[column, i, 1] = at, max(count - 1, 0)  # its NUL
                at += count
            elif op == NUMBERS:
                if count > 0:
                    at += (origin - at) % size
                if count > (end - at) // size:
                    bad[i] = True
                    break
                if column >= 0:
                    for k in range(count):
                        if filling:
                            value = _ordered(data, at + k * size, size, big)
                            flat[base[column] + used[column]] = value
                        used[column] += 1
                    counts[column, i] = count
                at += count * size
            elif op == LOOP:
                if count > end - at or depth + 1 == DEEPEST:  # an element takes a byte at least
                    bad[i] = True
                    break
                if count == 0:
                    step = size
                else:
                    depth += 1
                    left[depth] = count
        if bad[i]:
            for c in range(base.size):
                used[c] = before[c]
                counts[c, i] = 0
