"""LLVM's assembly, written by expressions: values with operators, loops as `with` blocks.

A vector has a number in each lane, and a lane belongs to one window or one segment. Numbers are
doubles; `contract` lets LLVM round a · b + c once where the processor can, and nothing else: no
sum is taken in another order than it is written in.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

INT, DOUBLE, POINTER = "i64", "double", "ptr"
BYTES = 8  # of a number, whole or not


def literal(value: float) -> str:
    """A double as LLVM reads it back to the last bit."""
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


@dataclass(frozen=True)
class Value:
    """A register or a constant: `text` of type `kind`, in a function that is being written."""

    function: Function
    text: str
    kind: str

    def _with(self, other: Value | float, whole: str, real: str, swapped: bool = False) -> Value:
        other = self.function.like(self, other)
        one, two = (other, self) if swapped else (self, other)
        operation = whole if self.kind == INT else f"{real} contract"
        return self.function.put(f"{operation} {self.kind} {one.text}, {two.text}", self.kind)

    def __add__(self, other: Value | float) -> Value:
        return self._with(other, "add", "fadd")

    def __radd__(self, other: float) -> Value:
        return self._with(other, "add", "fadd", True)

    def __sub__(self, other: Value | float) -> Value:
        return self._with(other, "sub", "fsub")

    def __rsub__(self, other: float) -> Value:
        return self._with(other, "sub", "fsub", True)

    def __mul__(self, other: Value | float) -> Value:
        return self._with(other, "mul", "fmul")

    def __rmul__(self, other: float) -> Value:
        return self._with(other, "mul", "fmul", True)

    def __truediv__(self, other: Value | float) -> Value:
        return self._with(other, "sdiv", "fdiv")

    def compared(self, how: str, other: Value | float) -> Value:
        """`how`: slt, sge, eq … of whole numbers, olt, oeq, une … of doubles."""
        other = self.function.like(self, other)
        operation = "icmp" if self.kind == INT else "fcmp"
        kind = self.kind.replace(INT, "i1").replace(DOUBLE, "i1")
        return self.function.put(f"{operation} {how} {self.kind} {self.text}, {other.text}", kind)

    def chosen(self, yes: Value, no: Value | float) -> Value:
        """`yes` where this is true, else `no`."""
        no = self.function.like(yes, no)
        text = f"select {self.kind} {self.text}, {yes.kind} {yes.text}, {no.kind} {no.text}"
        return self.function.put(text, yes.kind)


class Module:
    """Functions of one kind of ship. `lanes` in a vector."""

    def __init__(self, lanes: int) -> None:
        self.lanes = lanes
        self.vector = DOUBLE if lanes == 1 else f"<{lanes} x double>"
        self._parts: list[str] = []
        self._declared: set[str] = set()

    def declare(self, text: str) -> None:
        self._declared.add(text)

    @contextmanager
    def function(
        self, name: str, arguments: Sequence[tuple[str, str]], private: bool = False
    ) -> Iterator[tuple[Function, list[Value]]]:
        """One that returns nothing; `arguments` are (name, INT, DOUBLE or POINTER), no two
        pointers to the same memory."""
        made = Function(self)
        yield made, [Value(made, f"%{name}", kind) for name, kind in arguments]
        noted = ", ".join(
            f"{kind}{' noalias' if kind == POINTER else ''} %{name}" for name, kind in arguments
        )
        scope = "internal " if private else ""
        body = "\n".join(made.reserved + made.lines)
        self._parts.append(
            f"define {scope}void @{name}({noted}) #0 {{\nentry:\n{body}\n  ret void\n}}"
        )

    def adopt(self, other: Module) -> None:
        """Its functions, too."""
        self._parts += other._parts
        self._declared |= other._declared

    @property
    def text(self) -> str:
        width = 64 * self.lanes
        attributes = (
            f'attributes #0 = {{ nounwind "prefer-vector-width"="{width}" '
            f'"min-legal-vector-width"="{width}" }}'
        )
        return "\n\n".join((*sorted(self._declared), *self._parts, attributes)) + "\n"


class Function:
    """The body of a function as it is written."""

    def __init__(self, module: Module) -> None:
        self.module = module
        self.lines: list[str] = []
        self.reserved: list[str] = []
        self._count = 0
        self._block = "entry"

    def name(self) -> str:
        self._count += 1
        return f"v{self._count}"

    def put(self, text: str, kind: str) -> Value:
        name = f"%{self.name()}"
        self.lines.append(f"  {name} = {text}")
        return Value(self, name, kind)

    def say(self, text: str) -> None:
        self.lines.append(f"  {text}")

    # --- constants --------------------------------------------------------------------------

    def int(self, value: int) -> Value:
        return Value(self, str(value), INT)

    def number(self, value: float) -> Value:
        return Value(self, literal(value), DOUBLE)

    def lanes(self, value: float) -> Value:
        """The same number in every lane."""
        if self.module.lanes == 1:
            return self.number(value)
        each = ", ".join([f"double {literal(value)}"] * self.module.lanes)
        return Value(self, f"<{each}>", self.module.vector)

    def like(self, one: Value, other: Value | float) -> Value:
        """`other` in the type of `one`; a number becomes one in all lanes."""
        if not isinstance(other, Value):
            if one.kind == INT:
                return self.int(int(other))
            return self.number(other) if one.kind == DOUBLE else self.lanes(other)
        if other.kind == DOUBLE and one.kind == self.module.vector != DOUBLE:
            return self.spread(other)
        return other

    # --- memory -----------------------------------------------------------------------------

    def at(self, pointer: Value, index: Value | int) -> Value:
        """Pointer to the number `index` places on."""
        text = index.text if isinstance(index, Value) else str(index)
        return self.put(f"getelementptr double, ptr {pointer.text}, i64 {text}", POINTER)

    def load(self, pointer: Value, index: Value | int = 0, kind: str = DOUBLE) -> Value:
        return self.put(f"load {kind}, ptr {self.at(pointer, index).text}, align {BYTES}", kind)

    def store(self, value: Value, pointer: Value, index: Value | int = 0) -> None:
        place = self.at(pointer, index).text
        self.say(f"store {value.kind} {value.text}, ptr {place}, align {BYTES}")

    def load_lanes(self, pointer: Value, index: Value | int = 0) -> Value:
        """The vector `index` vectors on."""
        return self.load(pointer, self._vectors(index), self.module.vector)

    def store_lanes(self, value: Value, pointer: Value, index: Value | int = 0) -> None:
        self.store(value, pointer, self._vectors(index))

    def _vectors(self, index: Value | int) -> Value | int:
        return index * self.module.lanes

    def reserve(self, vectors: int = 1) -> Value:
        """Memory of the function's own for so many vectors, on its stack. It is reserved where
        the function begins, wherever this is said."""
        kind, name = self.module.vector, f"%{self.name()}"
        align = BYTES * self.module.lanes
        self.reserved.append(f"  {name} = alloca {kind}, i64 {vectors}, align {align}")
        return Value(self, name, POINTER)

    # --- lanes ------------------------------------------------------------------------------

    def spread(self, value: Value) -> Value:
        """A double into every lane."""
        count, vector = self.module.lanes, self.module.vector
        if count == 1:
            return value
        first = self.put(f"insertelement {vector} poison, double {value.text}, i64 0", vector)
        zeros = f"<{count} x i32> zeroinitializer"
        text = f"shufflevector {vector} {first.text}, {vector} poison, {zeros}"
        return self.put(text, vector)

    def together(self, values: Sequence[Value]) -> Value:
        """A double for each lane as a vector."""
        if self.module.lanes == 1:
            return values[0]
        vector = self.module.vector
        found = Value(self, "poison", vector)
        for lane, value in enumerate(values):
            text = f"insertelement {vector} {found.text}, double {value.text}, i64 {lane}"
            found = self.put(text, vector)
        return found

    def transposed(self, rows: Sequence[Value]) -> list[Value]:
        """As many vectors as there are lanes, rows for columns: by halves, quarters …"""
        count, vector = self.module.lanes, self.module.vector
        found, half = list(rows), count // 2
        while half:
            now = list(found)
            for i in range(count):
                if i & half:
                    continue
                a, b = found[i], found[i | half]
                low = [j if not j & half else count + (j ^ half) for j in range(count)]
                high = [j | half if not j & half else count + j for j in range(count)]
                for place, mask in ((i, low), (i | half, high)):
                    noted = ", ".join(f"i32 {m}" for m in mask)
                    now[place] = self.put(
                        f"shufflevector {vector} {a.text}, {vector} {b.text}, "
                        f"<{count} x i32> <{noted}>", vector,
                    )  # fmt: skip
            found, half = now, half // 2
        return found

    def intrinsic(self, name: str, *operands: Value) -> Value:
        """sqrt, fabs, floor, rint, copysign, minimum, maximum …"""
        kind = operands[0].kind
        suffix = "f64" if kind == DOUBLE else f"v{self.module.lanes}f64"
        given = ", ".join(f"{kind} {operand.text}" for operand in operands)
        full = f"@llvm.{name}.{suffix}"
        self.module.declare(f"declare {kind} {full}({', '.join([kind] * len(operands))})")
        return self.put(f"call {kind} {full}({given})", kind)

    def call(self, name: str, *arguments: Value) -> None:
        given = ", ".join(f"{a.kind} {a.text}" for a in arguments)
        self.say(f"call void @{name}({given})")

    # --- control ----------------------------------------------------------------------------

    @contextmanager
    def loop(
        self, stop: Value | int, start: Value | int = 0, step: int = 1, outer: bool = False
    ) -> Iterator[Value]:
        """for index from start, below stop, by step.

        outer   of a loop with others in it: its index is kept in memory, where LLVM does not look
                for what could be strength-reduced. In nests of loops that look takes seconds.
        """
        first, last = (v if isinstance(v, Value) else self.int(v) for v in (start, stop))
        tag = self.name()
        head, body, end = f"head.{tag}", f"body.{tag}", f"end.{tag}"
        index = Value(self, f"%i.{tag}", INT)
        before, slot = self._block, self.reserve() if outer else None
        if slot is not None:
            self.say(f"store volatile i64 {first.text}, ptr {slot.text}")
        self.say(f"br label %{head}")
        place = len(self.lines)  # of the head, whose second edge is known at the end
        self.lines += ["", "", "", ""]
        self._start(body)
        yield index
        latch = self._block
        after = index + step
        if slot is None:
            here = f"phi i64 [ {first.text}, %{before} ], [ {after.text}, %{latch} ]"
        else:
            here = f"load volatile i64, ptr {slot.text}"
            self.say(f"store volatile i64 {after.text}, ptr {slot.text}")
        self.say(f"br label %{head}")
        self.lines[place : place + 4] = [
            f"{head}:",
            f"  {index.text} = {here}",
            f"  %more.{tag} = icmp slt i64 {index.text}, {last.text}",
            f"  br i1 %more.{tag}, label %{body}, label %{end}",
        ]
        self._start(end)

    @contextmanager
    def when(self, test: Value) -> Iterator[None]:
        tag = self.name()
        then, end = f"then.{tag}", f"done.{tag}"
        self.say(f"br i1 {test.text}, label %{then}, label %{end}")
        self._start(then)
        yield
        self.say(f"br label %{end}")
        self._start(end)

    def _start(self, block: str) -> None:
        self.lines.append(f"{block}:")
        self._block = block

    def smaller(self, one: Value, other: Value | int) -> Value:
        """Of two whole numbers."""
        other = self.like(one, other)
        return one.compared("slt", other).chosen(one, other)
