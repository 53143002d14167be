"""Which rows of a text table are whole: as many values as its header has names, and no damage.

A row with another number of values is not shifted or filled up, since nobody knows which of its
values is missing or is one too many. It is left out and counted.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from shiplog.nomenclature.numbers import counted

CHUNK_BYTES = 1 << 23  # that are looked at together: memory goes with it, and not with the file
HABIT = 0.2  # share of rows: what so many have in common is the writer's habit, and no damage
REGULAR = 0.8  # share of rows whose last value is blank where a separator ends each row
LONGEST_TEXT = 20  # lines of one text in quotation marks
FIXED = 20  # rows before the last with one number of decimals: the last one's is no chance
COMMENT = re.compile(rb"\s*(#|%|//)|[^\d]*$")  # a remark between the rows, or a last line in words
NEWLINE, QUOTE, NUL = 10, 34, 0


@dataclass(frozen=True, slots=True)
class SoundRows:
    """The rows that are whole, what was left out, and how many values each row has."""

    body: bytes
    width: int
    lost: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class _Lines:
    """Each line of a text: where it begins and ends (its line feed not counted), and what is in it.

    values  fields that its separators make
    """

    start: np.ndarray
    end: np.ndarray
    values: np.ndarray
    nul: np.ndarray
    open: np.ndarray  # an odd number of quotation marks
    tail: np.ndarray  # separators at the line's end

    @property
    def filled(self) -> np.ndarray:
        return self.end > self.start


def sound_rows(body: bytes, separator: str, names: int, first_line: int, header: bytes = b"") -> (
    SoundRows | None
):  # fmt: skip
    """The rows of a text that are whole. None where its rows do not fit the header.

    body        UTF-8, lines end with a line feed
    names       how many the header has
    first_line  number of the first row's line in the file, for messages
    header      the line of the names: where it stands again, two files were put together
    """
    lines = _lines(body, separator)
    row = lines.filled & ~_remarks(body, lines, separator)
    if header:
        row &= ~_repeated(body, lines, header)
    if not row.any():
        return SoundRows(b"", names)
    width = _width(lines, row, names)
    if width is None:
        return None
    usual, shifted = _usual(lines, row, names, width)
    reasons = np.zeros(len(lines.start), np.int8)
    reasons[row & ((lines.values > width) | shifted)] = _MORE
    reasons[row & (lines.values < width)] = _FEWER
    reasons[usual] = _SOUND
    reasons[row & lines.nul] = _NULS
    written = _quoted(body, lines, row, separator, width, reasons)
    if _is_cut(body, lines, row, separator, reasons):
        reasons[np.flatnonzero(row)[-1]] = _CUT
    keep = row & (reasons == _SOUND)
    lost = tuple(_sentence(reasons, code, width, separator, first_line) for code in _SAID
                 if (reasons[row] == code).any())  # fmt: skip
    return SoundRows(_joined(body, lines, keep, written), width, lost)


_SOUND, _MORE, _FEWER, _NULS, _UNCLOSED, _CUT = range(6)
_SAID = {
    _MORE: "more values than the {width} columns, as of a {separator} in a text without quotation "
           "marks",
    _FEWER: "fewer values than the {width} columns, as of a line that was cut",
    _NULS: "NUL bytes, as after a power cut",
    _UNCLOSED: "a quotation mark that is not closed",
    _CUT: "a last number that is cut: the file ends in it",
}  # fmt: skip


def _sentence(reasons: np.ndarray, code: int, width: int, separator: str, first: int) -> str:
    at = np.flatnonzero(reasons == code)
    cut = {"\t": "tab", " ": "space", ",": "comma", ";": "semicolon"}.get(separator, separator)
    what = _SAID[code].format(width=width, separator=cut)
    where = f"line {at[0] + first + 1}" + (" is the first" if len(at) > 1 else "")
    return f"{counted(len(at), 'row')} with {what} ({where})"


def _lines(body: bytes, separator: str) -> _Lines:
    """Each line's place and values, by whole chunks of lines."""
    parts = [_of_chunk(*chunk, ord(separator)) for chunk in _chunks(body)]
    if not parts:
        none = np.zeros(0, np.int64)
        return _Lines(none, none, none, none > 0, none > 0, none)
    return _Lines(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _chunks(body: bytes) -> Iterator[tuple[int, np.ndarray]]:
    """(where it begins, its bytes) of pieces that end with a line."""
    whole = np.frombuffer(body, np.uint8)
    begin = 0
    while begin < len(body):
        end = len(body)
        if end - begin > CHUNK_BYTES:
            end = body.rfind(b"\n", begin, begin + CHUNK_BYTES) + 1
            end = end or body.find(b"\n", begin + CHUNK_BYTES) + 1 or len(body)
        yield begin, whole[begin:end]
        begin = end


def _of_chunk(begin: int, chunk: np.ndarray, separator: int) -> tuple[np.ndarray, ...]:
    ends = np.flatnonzero(chunk == NEWLINE)
    start = np.concatenate(([0], ends + 1))
    if start[-1] == len(chunk):
        start = start[:-1]
    else:
        ends = np.append(ends, len(chunk))
    between = chunk == separator
    odd = np.zeros(len(start), bool)
    quote = chunk == QUOTE
    if quote.any():
        odd = np.add.reduceat(quote.view(np.uint8), start, dtype=np.int32) % 2 == 1
        within = np.cumsum(quote, dtype=np.uint8)  # its last bit: whether inside of two marks
        if odd.any():  # each line by itself: what one leaves open, the next one does not close
            before = np.concatenate(([0], within[start[1:] - 1])).astype(np.uint8)
            within -= np.repeat(before, np.diff(np.append(start, len(chunk))))
        between &= within % 2 == 0
    values = np.add.reduceat(between.view(np.uint8), start, dtype=np.int32) + 1
    nul = chunk == NUL
    nuls = (
        np.add.reduceat(nul.view(np.uint8), start, dtype=np.int32) > 0 if nul.any() else odd & ~odd
    )
    stop = ends - ((ends > start) & (chunk[np.maximum(ends - 1, 0)] == 13))  # without the \r
    tail = np.zeros(len(start), np.int32)
    ended = np.arange(len(start))
    while len(ended):  # one separator further from the end each time
        last = stop[ended] - 1 - tail[ended]
        ended = ended[(last >= start[ended]) & (chunk[np.maximum(last, 0)] == separator)]
        tail[ended] += 1
    return start + begin, stop + begin, values, nuls, odd, tail


def _remarks(body: bytes, lines: _Lines, separator: str) -> np.ndarray:
    """Lines between the rows that are none: comments, and words without a separator."""
    usual = int(np.bincount(lines.values[lines.filled]).argmax()) if lines.filled.any() else 1
    remark = np.zeros(len(lines.start), bool)
    begins = np.frombuffer(body, np.uint8)[lines.start[lines.filled]]
    marked = np.isin(begins, (35, 37))  # of # and %
    if len(marked) and marked.mean() < HABIT:
        remark[np.flatnonzero(lines.filled)[marked]] = True
    for i in np.flatnonzero(lines.filled & (lines.values == 1) & (usual > 1) & ~lines.nul):
        remark[i] |= COMMENT.match(body, lines.start[i], lines.end[i]) is not None
    return remark


def _repeated(body: bytes, lines: _Lines, header: bytes) -> np.ndarray:
    """Lines that are the header once more."""
    found = np.zeros(len(lines.start), bool)
    header = header.rstrip(b"\r\n")
    for i in np.flatnonzero(lines.end - lines.start == len(header)):
        found[i] = body.startswith(header, lines.start[i])
    return found


def _width(lines: _Lines, row: np.ndarray, names: int) -> int | None:
    """How many values a row has: the header's names, and separators that end every row."""
    usual = int(np.bincount(lines.values[row]).argmax())
    of_usual = row & (lines.values == usual)
    if usual == names:
        return names
    if usual > names:
        ended = lines.tail[of_usual] >= usual - names
        return usual if ended.mean() >= REGULAR else None
    return names if (lines.values[row] == names).mean() >= HABIT else None


def _usual(lines: _Lines, row: np.ndarray, names: int, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows [n] bool that are of another width by the writer's habit: blanks at the end that are
    left out, or separators at the end that are one too many. And rows of this width that have a
    value too many, where a separator should end them."""
    if width > names:
        return row & (lines.values == names), row & (lines.values == width) & (
            lines.tail < width - names
        )
    sound = np.zeros(len(row), bool)
    for values in np.unique(lines.values[row]):
        alike = row & (lines.values == values)
        if values in (1, width) or alike.sum() < HABIT * row.sum():
            continue
        if values < width or (lines.tail[alike] >= values - width).all():
            sound |= alike
    return sound, np.zeros(len(row), bool)


def _quoted(
    body: bytes, lines: _Lines, row: np.ndarray, separator: str, width: int, reasons: np.ndarray
) -> dict[int, bytes]:
    """Lines with an odd number of quotation marks, read as csv does; what is written for them.

    A text in quotation marks may go over several lines; a mark inside a word is none.
    """
    written: dict[int, bytes] = {}
    used = -1
    for i in np.flatnonzero(row & lines.open & ~lines.nul):
        if i <= used:
            continue
        for last in range(i, min(i + LONGEST_TEXT, len(row))):
            text = body[lines.start[i] : lines.end[last]].decode("utf-8", "replace")
            fields = _fields(text, separator)
            if fields is not None:
                break
        else:
            fields = None
        if fields is None or (last > i and len(fields) != width):
            reasons[i] = _UNCLOSED
            continue
        used = last
        row[i + 1 : last + 1] = False
        code = np.sign(len(fields) - width)
        reasons[i] = {0: _SOUND, 1: _MORE, -1: _FEWER}[int(code)]
        written[int(i)] = _line(fields, separator)
    return written


def _fields(text: str, separator: str) -> list[str] | None:
    try:
        rows = list(csv.reader(text.splitlines(keepends=True), delimiter=separator, strict=True))
    except csv.Error:
        return None
    return rows[0] if len(rows) == 1 else None


def _line(fields: list[str], separator: str) -> bytes:
    special = re.compile(r'["\r\n' + re.escape(separator) + "]")
    quoted = ('"' + f.replace('"', '""') + '"' if special.search(f) else f for f in fields)
    return separator.join(quoted).encode()


def _is_cut(
    body: bytes, lines: _Lines, row: np.ndarray, separator: str, reasons: np.ndarray
) -> bool:
    """Whether the file ends inside a number: all rows before have so many decimals, and the last
    one, which no line feed ends, has fewer."""
    at = np.flatnonzero(row & (reasons == _SOUND))
    if body.endswith(b"\n") or len(at) <= FIXED or at[-1] != np.flatnonzero(lines.filled)[-1]:
        return False
    decimals = [
        _decimals(body[lines.start[i] : lines.end[i]], separator.encode()) for i in at[-FIXED - 1 :]
    ]
    *before, last = decimals
    return last is not None and len(set(before)) == 1 and 0 <= last < (before[0] or 0)


def _decimals(line: bytes, separator: bytes) -> int | None:
    """Digits after the decimal sign of a line's last value; None for what is no number."""
    number = re.fullmatch(
        rb'"?\s*-?\d+(?:[.,](\d*))?\s*', line.rsplit(separator, 1)[-1].rstrip(b'"')
    )
    return None if number is None else len(number[1] or b"")


def _joined(body: bytes, lines: _Lines, keep: np.ndarray, written: dict[int, bytes]) -> bytes:
    """The lines that are kept, one after the other."""
    other = np.zeros(len(keep), bool)
    other[[i for i in written if keep[i]]] = True
    if not other.any() and (keep | ~lines.filled).all():
        return body
    pieces: list[bytes] = []
    edges = np.flatnonzero(np.diff(np.concatenate(([0], (keep & ~other).astype(np.int8), [0]))))
    runs = [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
    singles = [(int(i), -1) for i in np.flatnonzero(other)]
    for first, last in sorted(runs + singles):
        if last < 0:
            pieces.append(written[first])
        else:
            pieces.append(body[lines.start[first] : lines.end[last - 1]])
    return b"\n".join(pieces)
