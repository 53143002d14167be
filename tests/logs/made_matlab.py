"""MATLAB files as bytes, by the documented layouts (MAT-File Format, R2024a; HDF5 as MATLAB uses
it): no library that reads them has a part in them, but for HDF5's own."""

from __future__ import annotations

import struct

import numpy as np

MI_INT8, MI_UINT8, MI_INT16, MI_UINT16, MI_INT32, MI_UINT32, MI_DOUBLE, MI_MATRIX = (
    1, 2, 3, 4, 5, 6, 9, 14
)  # fmt: skip
MX_DOUBLE = 6
STORED = {np.dtype("u1"): MI_UINT8, np.dtype("i2"): MI_INT16, np.dtype("u2"): MI_UINT16,
          np.dtype("f8"): MI_DOUBLE}  # fmt: skip


def level_4(order: str, **matrices: np.ndarray) -> bytes:
    """Version 4: five numbers, the name, and the numbers column by column."""
    out = b""
    for name, matrix in matrices.items():
        value = np.atleast_2d(np.asarray(matrix, float))
        kind = 1000 if order == ">" else 0
        out += struct.pack(f"{order}5i", kind, *value.shape, 0, len(name) + 1)
        out += name.encode() + b"\0" + value.astype(f"{order}f8").tobytes("F")
    return out


def level_5(order: str, stored: str = "f8", **matrices: np.ndarray) -> bytes:
    """Version 5 with doubles whose numbers are stored in fewer bytes, as MATLAB does of whole
    ones."""
    head = b"MATLAB 5.0 MAT-file, Platform: GLNXA64".ljust(124)
    out = head + struct.pack(f"{order}HH", 0x0100, 0x4D49)
    for name, matrix in matrices.items():
        value = np.atleast_2d(np.asarray(matrix))
        numbers = value.astype(np.dtype(stored).newbyteorder(order))
        body = _element(order, MI_UINT32, struct.pack(f"{order}II", MX_DOUBLE, 0))
        body += _element(order, MI_INT32, struct.pack(f"{order}ii", *value.shape))
        body += _element(order, MI_INT8, name.encode())
        body += _element(order, STORED[np.dtype(stored)], numbers.tobytes("F"))
        out += _element(order, MI_MATRIX, body)
    return out


def _element(order: str, kind: int, data: bytes) -> bytes:
    padded = data + bytes(-len(data) % 8)
    return struct.pack(f"{order}II", kind, len(data)) + padded


def write_7_3(path, **variables) -> None:
    """Version 7.3: HDF5 behind 512 bytes of MATLAB's. What MATLAB has as rows is a column here; a
    dict is a struct, a group of its fields; an empty array has its sizes as data."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in variables.items():
            _put(file, name, value)
    with open(path, "r+b") as stream:
        head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, HDF5 schema 1.00 .".ljust(116)
        stream.write(head + bytes(8) + struct.pack("<HH", 0x0200, 0x4D49))


def _put(group, name: str, value) -> None:
    if isinstance(value, dict):
        inner = group.create_group(name)
        inner.attrs["MATLAB_class"] = np.bytes_("struct")
        for field, part in value.items():
            _put(inner, field, part)
        return
    array = np.asarray(value)
    if array.size == 0:
        dataset = group.create_dataset(name, data=np.array([0, 0], np.uint64))
        dataset.attrs["MATLAB_class"] = np.bytes_("double")
        dataset.attrs["MATLAB_empty"] = np.uint8(1)
        return
    if array.dtype == bool:
        dataset = group.create_dataset(name, data=np.atleast_2d(array).T.astype(np.uint8))
        dataset.attrs["MATLAB_class"] = np.bytes_("logical")
        dataset.attrs["MATLAB_int_decode"] = np.int32(1)
        return
    dataset = group.create_dataset(name, data=np.atleast_2d(array).T.astype(float))
    dataset.attrs["MATLAB_class"] = np.bytes_("double")
