"""Payloads of Sparkplug B (specification 3.0, section 6.4) and their bytes: protobuf, and of it what telemetry uses.

Numbers of fields and types are those of the specification's sparkplug_b.proto. Fields that are not used here, such as
properties and data sets, are passed over when bytes are read.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum

LARGEST = 1_000_000
MOST_METRICS = 1000
Value = int | float | bool | str
_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
_NAME, _ALIAS, _TIMESTAMP, _DATATYPE, _HISTORICAL, _NULL = 1, 2, 3, 4, 5, 7
_INT, _LONG, _FLOAT, _DOUBLE, _BOOLEAN, _STRING = 10, 11, 12, 13, 14, 15


class PayloadError(ValueError):
    """Bytes that are no payload."""


class DataType(IntEnum):
    """Types of values."""

    UNKNOWN = 0
    INT64 = 4
    UINT64 = 8
    DOUBLE = 10
    BOOLEAN = 11
    STRING = 12
    DATETIME = 13


@dataclass(frozen=True)
class Metric:
    """A value and when it was so, Unix time in ms. None = not known. A birth gives each name its alias and type; what
    follows names the alias alone.
    """

    value: Value | None
    datatype: DataType = DataType.UNKNOWN
    name: str | None = None
    alias: int | None = None
    timestamp_ms: int | None = None
    historical: bool = False


@dataclass(frozen=True)
class Payload:
    """Metrics, and when they were sent, Unix time in ms. seq: 0 to 255; None in a death and in commands."""

    timestamp_ms: int
    metrics: tuple[Metric, ...]
    seq: int | None = None


def encoded(payload: Payload, *, types: bool) -> bytes:
    """The payload's bytes. types: whether the metrics' types go with them, as in a birth."""
    parts = [_number(1, payload.timestamp_ms)]
    parts += [_sized(2, _metric(metric, types)) for metric in payload.metrics]
    if payload.seq is not None:
        parts.append(_number(3, payload.seq))
    return b"".join(parts)


def _metric(metric: Metric, types: bool) -> bytes:
    parts = []
    if metric.name is not None:
        parts.append(_sized(_NAME, metric.name.encode()))
    if metric.alias is not None:
        parts.append(_number(_ALIAS, metric.alias))
    if metric.timestamp_ms is not None:
        parts.append(_number(_TIMESTAMP, metric.timestamp_ms))
    if types:
        parts.append(_number(_DATATYPE, metric.datatype))
    if metric.historical:
        parts.append(_number(_HISTORICAL, 1))
    parts.append(_number(_NULL, 1) if metric.value is None else _value(metric.datatype, metric.value))
    return b"".join(parts)


def _value(datatype: DataType, value: Value) -> bytes:
    if datatype is DataType.STRING:
        return _sized(_STRING, str(value).encode(errors="replace"))
    if datatype is DataType.DOUBLE:
        return _varint(_DOUBLE << 3 | _FIXED64) + struct.pack("<d", value)
    return _number(_BOOLEAN if datatype is DataType.BOOLEAN else _LONG, int(value))


def _number(field: int, number: int) -> bytes:
    return _varint(field << 3 | _VARINT) + _varint(number % 2**64)


def _sized(field: int, content: bytes) -> bytes:
    return _varint(field << 3 | _BYTES) + _varint(len(content)) + content


def _varint(number: int) -> bytes:
    parts = bytearray()
    while number > 0x7F:
        parts.append(number & 0x7F | 0x80)
        number >>= 7
    parts.append(number)
    return bytes(parts)


# --- reading ----------------------------------------------------------------------------------------------------------


def decoded(raw: bytes) -> Payload:
    """The payload that the bytes hold; raise PayloadError."""
    if len(raw) > LARGEST:
        raise PayloadError(f"{len(raw)} bytes, expected {LARGEST} at most")
    timestamp_ms, seq = 0, None
    metrics: list[Metric] = []
    for field, value in _fields(raw):
        if len(metrics) > MOST_METRICS:
            raise PayloadError(f"more than {MOST_METRICS} metrics")
        if field == 1 and isinstance(value, int):
            timestamp_ms = value
        elif field == 2 and isinstance(value, bytes):
            metrics.append(_metric_of(value))
        elif field == 3 and isinstance(value, int):
            seq = value
    return Payload(timestamp_ms, tuple(metrics), seq)


def _metric_of(raw: bytes) -> Metric:
    """raw: of one metric. Of a value that is there several times the last counts, as protobuf has it."""
    found = dict(_fields(raw))
    numbers = {field: value for field, value in found.items() if isinstance(value, int)}
    name, datatype = found.get(_NAME), numbers.get(_DATATYPE, 0)
    return Metric(
        None if numbers.get(_NULL) else _value_of(found),
        DataType(datatype) if datatype in list(DataType) else DataType.UNKNOWN,
        _text(name) if isinstance(name, bytes) else None,
        numbers.get(_ALIAS),
        numbers.get(_TIMESTAMP),
        bool(numbers.get(_HISTORICAL)),
    )


def _value_of(found: dict[int, int | bytes]) -> Value | None:
    for field in (_INT, _LONG, _FLOAT, _DOUBLE, _BOOLEAN, _STRING):
        value = found.get(field)
        if isinstance(value, int) and field in (_INT, _LONG, _BOOLEAN):
            return bool(value) if field == _BOOLEAN else value
        if isinstance(value, bytes) and field in (_FLOAT, _DOUBLE, _STRING):
            return _text(value) if field == _STRING else _real(value)
    return None


def _real(raw: bytes) -> float:
    if len(raw) not in (4, 8):
        raise PayloadError(f"a number of {len(raw)} bytes, expected 4 or 8")
    return float(struct.unpack("<d" if len(raw) == 8 else "<f", raw)[0])


def _text(raw: bytes) -> str:
    return raw.decode("utf-8", "replace")


def _fields(raw: bytes) -> Iterator[tuple[int, int | bytes]]:
    """Number and content of each field of a message: a whole number, or bytes; raise PayloadError."""
    at = 0
    while at < len(raw):
        key, at = _varint_at(raw, at)
        kind = key & 7
        if kind == _VARINT:
            value, at = _varint_at(raw, at)
            yield key >> 3, value
            continue
        if kind == _BYTES:
            size, at = _varint_at(raw, at)
        elif kind in (_FIXED64, _FIXED32):
            size = 8 if kind == _FIXED64 else 4
        else:
            raise PayloadError(f"a field of wire type {kind}, expected 0, 1, 2 or 5")
        if at + size > len(raw):
            raise PayloadError(f"a field of {size} bytes where {len(raw) - at} are left")
        yield key >> 3, raw[at : at + size]
        at += size


def _varint_at(raw: bytes, at: int) -> tuple[int, int]:
    """The number that begins there, and where it ends."""
    number = 0
    for place, byte in enumerate(raw[at : at + 10]):
        number |= (byte & 0x7F) << 7 * place
        if byte < 0x80:
            return number, at + place + 1
    raise PayloadError("a number that does not end")
