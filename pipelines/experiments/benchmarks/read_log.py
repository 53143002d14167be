"""How fast an MCAP log becomes tables, against the plain `mcap` route, and in how much memory.

    python -m pipelines.experiments.benchmarks.read_log [--hours 2]

Each route runs in a process of its own on the same file: six topics at 10 Hz, protobuf, zstd. Its
first log ("cold") also starts the process that Rerun's reader runs in; the second finds it there.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

TOPICS = {  # topic: (schema, its numbers); every message has timestamp and frame_id as well
    "/gnss/fix": ("bench.Fix", ("latitude", "longitude", "altitude")),
    "/gnss/velocity": ("bench.GnssVelocity", ("sog_mps", "cog_deg")),
    "/gyro": ("bench.Gyro", ("heading_deg", "yaw_rate_degps")),
    "/wind/apparent": ("bench.Wind", ("speed_mps", "direction_deg")),
    "/rudder/port": ("bench.Rudder", ("angle_deg",)),
    "/propeller/main": ("bench.Propeller", ("speed_rps",)),
}
START = 1_760_000_000 * 1_000_000_000
RATE = 10  # Hz, each topic
GOALS = {"messages_per_s": 300_000, "times_the_peer": 5.0, "peak_mb_8h": 500.0}


def write(path: Path, hours: float) -> int:
    """A log with hand-packed payloads: the protobuf package would take longer than the reading."""
    from mcap.writer import Writer

    steps = int(hours * 3600 * RATE)
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channels = []
        for topic, (schema, names) in TOPICS.items():
            number = writer.register_schema(schema, "protobuf", descriptors(schema, names))
            channels.append((writer.register_channel(topic, "protobuf", number), len(names)))
        for step in range(steps):
            when = START + step * 1_000_000_000 // RATE
            stamp = _stamp(when)
            for order, (channel, width) in enumerate(channels):
                data = stamp + _numbers(step, order, width)
                writer.add_message(channel, when + 2_000_000, data, when, step)
        writer.finish()
    return steps * len(TOPICS)


def descriptors(schema: str, names: tuple[str, ...]) -> bytes:
    """A self-contained FileDescriptorSet: timestamp, frame_id, then the numbers as doubles."""
    from google.protobuf import descriptor_pb2 as pb
    from google.protobuf import timestamp_pb2

    package, _, name = schema.partition(".")
    clock = pb.FileDescriptorProto()
    timestamp_pb2.DESCRIPTOR.CopyToProto(clock)
    file = pb.FileDescriptorProto(
        name=f"{schema}.proto", package=package, syntax="proto3", dependency=[clock.name]
    )
    message = file.message_type.add(name=name)
    kinds = pb.FieldDescriptorProto
    message.field.add(
        name="timestamp", number=1, label=kinds.LABEL_OPTIONAL, type=kinds.TYPE_MESSAGE,
        type_name=".google.protobuf.Timestamp",
    )  # fmt: skip
    for number, field in enumerate(("frame_id", *names), start=2):
        kind = kinds.TYPE_STRING if number == 2 else kinds.TYPE_DOUBLE
        message.field.add(name=field, number=number, label=kinds.LABEL_OPTIONAL, type=kind)
    return pb.FileDescriptorSet(file=[clock, file]).SerializeToString()


def _stamp(when: int) -> bytes:
    seconds, nanos = divmod(when, 1_000_000_000)
    inner = b"\x08" + _varint(seconds) + (b"\x10" + _varint(nanos) if nanos else b"")
    return b"\x0a" + bytes([len(inner)]) + inner + b"\x12\x04ship"


def _numbers(step: int, order: int, width: int) -> bytes:
    import struct

    packed = b""
    for k in range(width):
        value = 10.0 * order + k + math.sin(0.01 * step + k)
        packed += bytes([(3 + k) << 3 | 1]) + struct.pack("<d", value)
    return packed


def _varint(value: int) -> bytes:
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def by_shiplog(path: Path) -> Iterator[int]:
    """Rows of each table, through `shiplog.logs.reading.read`."""
    from shiplog.logs.reading.read import read

    wanted = {topic: names for topic, (_, names) in TOPICS.items()}
    for frame in read(path, wanted).frames.values():
        yield frame.height


def by_shiplog_everything(path: Path) -> Iterator[int]:
    """The same without saying which fields are wanted."""
    from shiplog.logs.reading.read import read

    for frame in read(path).frames.values():
        yield frame.height


def by_mcap(path: Path) -> Iterator[int]:
    """The peer: `mcap` with its protobuf decoder, the same columns, then polars."""
    import polars as pl
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    columns: dict[str, list[list]] = {
        t: [[] for _ in range(3 + len(n))] for t, (_, n) in TOPICS.items()
    }
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            into = columns[channel.topic]
            into[0].append(message.log_time)
            into[1].append(message.publish_time)
            into[2].append(decoded.timestamp.seconds * 1_000_000_000 + decoded.timestamp.nanos)
            for column, name in zip(into[3:], TOPICS[channel.topic][1], strict=True):
                column.append(getattr(decoded, name))
    for topic, (_, names) in TOPICS.items():
        named = zip(("log_time", "publish_time", "stamp", *names), columns[topic], strict=True)
        yield pl.DataFrame(dict(named)).height


ROUTES = {"shiplog": by_shiplog, "shiplog, every field": by_shiplog_everything, "mcap": by_mcap}


def measure(route: str, path: Path) -> dict[str, float]:
    """Run one route in a process of its own: seconds without imports, and peak memory."""
    command = [sys.executable, "-m", __spec__.name if __spec__ else __name__, "--route", route]
    done = subprocess.run(
        [*command, "--log", str(path)], check=True, capture_output=True, text=True
    )
    return json.loads(done.stdout.splitlines()[-1])


def _one_route(route: str, path: Path) -> None:
    import resource

    import polars  # noqa: F401 - import times are not the reading's

    import shiplog.logs.reading.read  # noqa: F401
    from shiplog.logs.reading import rerun_route

    seconds: list[float] = []
    rows = 0
    for _ in range(1 if route == "mcap" else 2):
        begin = time.perf_counter()
        rows = sum(ROUTES[route](path))
        seconds.append(time.perf_counter() - begin)
    rerun_route.worker().stop()
    own, workers = (
        resource.getrusage(who).ru_maxrss / 1024
        for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    found = {"rows": rows, "cold": seconds[0], "warm": seconds[-1]}
    print(json.dumps(found | {"peak_mb": own, "worker_mb": workers}))


def _line(route: str, count: int, found: dict[str, float]) -> str:
    speeds = f"{count / found['cold']:9.0f} cold, {count / found['warm']:9.0f} warm messages/s"
    both = found["peak_mb"] + found["worker_mb"]
    memory = f"peak {found['peak_mb']:.0f} MB + worker {found['worker_mb']:.0f} = {both:.0f} MB"
    return f"  {route:22}{speeds}, {memory}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--hours", type=float, default=2.0, help="length of the log for the ratio")
    parser.add_argument("--route", choices=ROUTES, help=argparse.SUPPRESS)
    parser.add_argument("--log", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.route:
        _one_route(options.route, options.log)
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.mcap"
        for hours, routes in ((options.hours, list(ROUTES)), (8.0, list(ROUTES)[:2])):
            count = write(path, hours)
            print(f"{count} protobuf messages, {hours:g} h, {path.stat().st_size / 1e6:.1f} MB")
            seconds: dict[str, float] = {}
            for route in routes:
                found = measure(route, path)
                assert found["rows"] == count, f"{route} read {found['rows']:.0f} of {count}"
                seconds[route] = found["warm"]
                print(_line(route, count, found))
            if "mcap" in seconds:
                print(f"  ratio {seconds['mcap'] / seconds['shiplog']:.1f}")
    print(f"goals: {GOALS}")


if __name__ == "__main__":
    main()
