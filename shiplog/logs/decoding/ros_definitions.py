"""Message definitions of ROS: .msg text of ROS 1 and 2, and IDL, as recorders store them.

A definition is the fields of a message, with those of its parts behind lines of `=`. Names are kept
as they are: ROS 1 allows capitals, which the rules of ROS 2 do not.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from mcap.records import Schema

RULE = re.compile(r"^={3,}[ \t]*$", re.MULTILINE)
SECTION = re.compile(r"\s*(MSG|IDL):[ \t]*(\S+)[ \t]*(?:\n|$)")
FIELD = re.compile(r"(?P<kind>\S+)\s+(?P<name>[A-Za-z_]\w*)\s*(?P<constant>=(?!=))?")
KIND = re.compile(r"(?P<base>[A-Za-z][\w/]*)(?:<=\d+)?(?P<list>\[(?P<most><=)?(?P<count>\d*)\])?")
IDL = re.compile(r"^\s*(module|struct)\s+\w+\s*\{", re.MULTILINE)
DIRECTIVE = re.compile(r"^[ \t]*#.*$", re.MULTILINE)
ENUM = re.compile(r"\benum\s+(\w+)")
PRIMITIVE = frozenset((
    "bool", "byte", "char", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64",
    "uint64", "float32", "float64", "string", "wstring",
))  # fmt: skip
CLOCK = {  # what writers may leave out; the names are those of ROS 2 in both
    "builtin_interfaces/Time": ("uint32 sec", "uint32 nanosec"),
    "builtin_interfaces/Duration": ("int32 sec", "uint32 nanosec"),
}
# Logs of ROS 2 before Iron hold no definitions; those of its own messages have hardly changed.
DEFAULT_TYPES = "ROS2_HUMBLE"
ROS1 = {"time": "builtin_interfaces/Time", "duration": "builtin_interfaces/Duration"}


@dataclass(frozen=True, slots=True)
class Field:
    """kind: a primitive type, or `package/Name`. count: of a list 0 where it has any length, None
    where there is one value."""

    name: str
    kind: str
    count: int | None = None


@dataclass(frozen=True, slots=True)
class Definition:
    """The fields of every type, and which of them the message is."""

    root: str
    types: dict[str, tuple[Field, ...]]


def definition(schema: Schema) -> Definition:
    """Of a schema in ros1msg, ros2msg or ros2idl. Raises ValueError where it is not one."""
    types: dict[str, tuple[Field, ...]] = {}
    root = short(schema.name)
    for at, section in enumerate(RULE.split(schema.data.decode("utf-8", "replace"))):
        named = SECTION.match(section)
        body = section[named.end() :] if named else section
        if named is None and at and not body.strip():
            continue
        if (named and named[1] == "IDL") or IDL.search(body):  # whatever the recorder called it
            types.update(_of_idl(body) if body.strip() else {})
        else:
            name = short(named[2]) if named else root
            types[name] = tuple(_of_text(body, name.split("/")[0]))
    if root not in types:
        raise ValueError(f"nothing says what a {schema.name} holds")
    for name, fields in CLOCK.items():
        types.setdefault(name, tuple(_of_text("\n".join(fields), "")))
    resolved = {
        name: tuple(_resolved(f, name, types) for f in fields) for name, fields in types.items()
    }
    return Definition(root, resolved)


def short(name: str) -> str:
    """`package/Name` of `package/msg/Name` or `package::msg::dds_::Name_`."""
    parts = [part for part in re.split(r"/|::", name) if part]
    return f"{parts[0]}/{parts[-1]}" if len(parts) > 1 else parts[0] if parts else ""


def _of_text(text: str, package: str) -> Iterator[Field]:
    for line in text.splitlines():
        line = line.strip()
        if not line or line.startswith("#"):
            continue
        made = FIELD.match(line)
        kind = KIND.fullmatch(made["kind"]) if made else None
        if made is None or kind is None:
            raise ValueError(f"{line[:80]!r} is no field of a message")
        if made["constant"]:
            continue
        count = None
        if kind["list"]:
            count = 0 if kind["most"] or not kind["count"] else int(kind["count"])
        base = kind["base"]
        if base == "Header":
            base = "std_msgs/Header"
        if base not in PRIMITIVE and base not in ROS1:
            base = short(base if "/" in base else f"{package}/{base}")
        yield Field(made["name"], ROS1.get(base, base), count)


def _of_idl(text: str) -> dict[str, tuple[Field, ...]]:
    """Raises ValueError for what has no place in a message, as a wide letter."""
    from rosbags.interfaces import Nodetype  # few logs need it
    from rosbags.typesys import TypesysError, get_types_from_idl

    def field(name: str, described) -> Field:
        node, inside = described
        if node == Nodetype.BASE:
            return Field(name, inside[0])
        if node == Nodetype.NAME:
            is_enum = inside.rsplit("/", 1)[-1] in enums
            return Field(name, "uint32" if is_enum else short(inside))
        element, count = inside
        return Field(name, field(name, element).kind, count if node == Nodetype.ARRAY else 0)

    enums = set(ENUM.findall(text))
    try:  # its parser knows no directives, of which every IDL file of ROS has some
        found = get_types_from_idl(DIRECTIVE.sub("", text))
    except TypesysError as error:
        raise ValueError(
            f"it is no IDL that can be read: {' '.join(str(error).split())[:80]}"
        ) from None
    return {
        short(name): tuple(
            field(n, d) for n, d in fields if n != "structure_needs_at_least_one_member"
        )
        for name, (_, fields) in found.items()
    }  # fmt: skip


def _resolved(field: Field, inside: str, types: dict[str, tuple[Field, ...]]) -> Field:
    """The field with a type that is defined; of a name alone, in whichever package it is."""
    if field.kind in PRIMITIVE or field.kind in types:
        return field
    last = field.kind.rsplit("/", 1)[-1]
    named = [name for name in types if name.rsplit("/", 1)[-1] == last]
    if len(named) == 1 and field.kind.split("/")[0] == inside.split("/")[0]:
        return Field(field.name, named[0], field.count)
    raise ValueError(f"nothing says what the {field.kind} {field.name!r} of a {inside} holds")


def of_its_name(schema: Schema) -> Schema | None:
    """The schema with ROS 2's own definition of this name, where it has one and the log none."""
    from rosbags.typesys import Stores, TypesysError, get_typestore  # few logs need it

    try:
        text, _ = get_typestore(Stores[DEFAULT_TYPES]).generate_msgdef(schema.name, ros_version=2)
    except (TypesysError, KeyError):
        return None
    return replace(schema, encoding="ros2msg", data=text.encode())
