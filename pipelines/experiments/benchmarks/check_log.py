"""How long `shiplog check` takes on a gigabyte, and in how much memory.

    python -m pipelines.experiments.benchmarks.check_log [--gigabytes 1] [--hours 20]

Two logs: half an hour of a sample voyage together with a camera's pictures, which make up the
gigabyte, as in most logs of that size; and sensors alone for so many hours, the sample voyage over
and over. Each is checked once to have it in memory, and once more for the figure, by the command as
a user types it, its start included.
"""

from __future__ import annotations

import argparse
import random
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SAMPLE = Path(__file__).parents[3] / "sample_logs" / "voyage_2.mcap"
PICTURE_BYTES = 120_000  # of JPEG, which no compression makes smaller
CHUNK_BYTES = 4 << 20
GOAL_S = 5.0


def with_camera(path: Path, size: float) -> int:
    """The sample voyage and as many pictures as make `size` bytes; how many messages."""
    from google.protobuf import descriptor_pb2 as pb
    from mcap.reader import make_reader
    from mcap.writer import Writer

    file = pb.FileDescriptorProto(name="bench.proto", package="bench", syntax="proto3")
    kind = file.message_type.add(name="Picture")
    kind.field.add(name="data", number=1, type=pb.FieldDescriptorProto.TYPE_BYTES, label=1)
    described = pb.FileDescriptorSet(file=[file]).SerializeToString()
    length = bytes([PICTURE_BYTES & 127 | 128, PICTURE_BYTES >> 7 & 127 | 128, PICTURE_BYTES >> 14])
    chance = random.Random(1)
    with SAMPLE.open("rb") as source, path.open("wb") as stream:
        reader = make_reader(source)
        summary = reader.get_summary()
        assert summary and summary.statistics
        writer = Writer(stream, chunk_size=CHUNK_BYTES)
        writer.start()
        schemas = {n: writer.register_schema(s.name, s.encoding, s.data)
                   for n, s in summary.schemas.items()}  # fmt: skip
        channels = {n: writer.register_channel(c.topic, c.message_encoding, schemas[c.schema_id])
                    for n, c in summary.channels.items()}  # fmt: skip
        camera = writer.register_channel(
            "/camera", "protobuf", writer.register_schema("bench.Picture", "protobuf", described)
        )
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata)
        every = summary.statistics.message_count // int(size / PICTURE_BYTES)
        for number, (_, channel, message) in enumerate(reader.iter_messages()):
            now = message.log_time, message.publish_time
            if number % every == 0:
                picture = b"\x0a" + length + chance.randbytes(PICTURE_BYTES)
                writer.add_message(camera, now[0], picture, now[1], number)
            writer.add_message(channels[channel.id], now[0], message.data, now[1], number)
        writer.finish()
        return summary.statistics.message_count


def of_sensors(path: Path, hours: float) -> int:
    """The sample voyage over and over; how many messages."""
    import numpy as np

    from shiplog.logs.conversion.write import Series, write_log
    from shiplog.logs.reading.read import read

    found = read(SAMPLE)
    series, count = [], 0
    for topic, frame in found.frames.items():
        numbers = [n for n, t in frame.schema.items() if t.is_float()]
        times = frame["stamp"].to_numpy()
        length = int(times[-1] - times[0]) + 100_000_000
        laps = int(hours * 3600e9 / length)
        later = np.repeat(np.arange(laps) * length, len(times))
        tiled = {n: np.tile(frame[n].to_numpy(), laps) for n in numbers}
        series.append(
            Series(topic, found.contents.topics[topic].schema, np.tile(times, laps) + later, tiled)
        )
        count += len(later)
    write_log(path, series, ship=found.contents.metadata["voyage"]["ship"])
    return count


def check(path: Path) -> tuple[float, float, float]:
    """Seconds, processor seconds, and MB at most of one `shiplog check`."""
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-m", "shiplog.cli", "check", str(path), "--profile", "esso-vectwin"]
    subprocess.run(command, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    busy = sum(getattr(after, n) - getattr(before, n) for n in ("ru_utime", "ru_stime"))
    return time.perf_counter() - began, busy, after.ru_maxrss / 1024


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--gigabytes", type=float, default=1.0, help="of the log with a camera")
    parser.add_argument("--hours", type=float, default=20.0, help="of the log of sensors alone")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for name, make, amount in (
            ("with a camera", with_camera, 1e9 * options.gigabytes),
            ("sensors alone", of_sensors, options.hours),
        ):
            path = Path(folder) / "log.mcap"
            count = make(path, amount)
            check(path)
            seconds, busy, most = check(path)
            print(
                f"{name}: {path.stat().st_size / 1e9:.2f} GB, {count} sensor messages: "
                f"{seconds:.1f} s ({busy:.1f} s of processor), at most {most:.0f} MB"
            )
            path.unlink()
    print(f"goal: {GOAL_S:g} s")


if __name__ == "__main__":
    main()
