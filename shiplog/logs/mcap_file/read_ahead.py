"""Chunks read, unpacked and checked before a walk comes to them, two at a time.

Reading, zstd, lz4 and CRC-32 run without Python's lock: two threads take half the time of one.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import IO, NamedTuple

from mcap.records import Chunk, ChunkIndex

from shiplog.logs.mcap_file import chunks
from shiplog.logs.mcap_file.container import read_at
from shiplog.logs.mcap_file.records import HEAD

THREADS = 2
MOST_AHEAD = 6  # chunks that wait for the walk, each of at most chunks.AT_ONCE twice
AHEAD_BYTES = 32 << 20  # bytes, packed and unpacked, of those that wait, as the index states them
FEWEST_CHUNKS = 8  # below which threads cost more than they save

Unpacked = tuple[bytes, Chunk | ValueError]  # a chunk's body, and the chunk or what is wrong


class _Pending(NamedTuple):
    position: int  # of the record
    length: int  # of its body
    held: int  # bytes that count against AHEAD_BYTES
    result: Future[Unpacked | None]


class ReadAhead:
    """Chunks by their position, whether the summary names them or not. A context: its threads end
    with it."""

    def __init__(self, stream: IO[bytes], path: Path, indexed: Mapping[int, ChunkIndex]) -> None:
        self._stream, self._path = stream, path
        self._left = deque(sorted(indexed.items()))
        self._waiting: deque[_Pending] = deque()
        self._ready: tuple[int, Chunk | ValueError] | None = None  # of the body handed out last
        self._pool: ThreadPoolExecutor | None = None
        if len(indexed) >= FEWEST_CHUNKS:
            self._pool = ThreadPoolExecutor(THREADS, thread_name_prefix="chunks")

    def __enter__(self) -> ReadAhead:
        return self

    def __exit__(self, *why: object) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def body(self, position: int, length: int) -> bytes:
        """The body of the record at `position`."""
        ahead = self._take(position, length)
        if ahead is None:
            self._ready = None
            return read_at(self._stream, position + HEAD.size, length)
        self._ready = position, ahead[1]
        return ahead[0]

    def opened(self, position: int, packed: Chunk) -> Chunk:
        """The chunk made of the body at `position`, checked; raises ValueError as
        `chunks.opened`."""
        if self._ready is None or self._ready[0] != position:
            return chunks.opened(packed)
        result = self._ready[1]
        if isinstance(result, ValueError):
            raise result
        return result

    def _take(self, position: int, length: int) -> Unpacked | None:
        while self._waiting and self._waiting[0].position < position:
            self._waiting.popleft()  # passed over: it is damaged
        while self._left and self._left[0][0] < position:
            self._left.popleft()
        self._submit()
        if not self._waiting or self._waiting[0][:2] != (position, length):
            return None
        return self._waiting.popleft().result.result()

    def _submit(self) -> None:
        held = sum(one.held for one in self._waiting)
        while self._pool and self._left and len(self._waiting) < MOST_AHEAD and held < AHEAD_BYTES:
            position, entry = self._left.popleft()
            length, size = entry.chunk_length - HEAD.size, entry.uncompressed_size
            if not 0 < length <= chunks.AT_ONCE or size > chunks.AT_ONCE:
                continue  # the walk takes the large ones piece by piece
            held += length + size
            result = self._pool.submit(_unpacked, self._path, position + HEAD.size, length)
            self._waiting.append(_Pending(position, length, length + size, result))


def _unpacked(path: Path, begin: int, length: int) -> Unpacked | None:
    """None where there is no chunk, or one that is larger than its index says."""
    with path.open("rb") as stream:
        body = read_at(stream, begin, length)
    packed = chunks.chunk(body) if len(body) == length else None
    if packed is None or packed.uncompressed_size > chunks.AT_ONCE:
        return None
    try:
        return body, chunks.opened(packed)
    except ValueError as error:
        return body, error
