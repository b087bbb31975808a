"""Modbus RTU frames by hand, for servers and lines that tests play."""

from __future__ import annotations


def crc16(data: bytes) -> bytes:
    """The CRC of an RTU frame, in the order in which it is sent."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0xA001 if crc & 1 else crc >> 1
    return crc.to_bytes(2, "little")


def frame(body: bytes) -> bytes:
    """Device id and PDU with their CRC behind them."""
    return body + crc16(body)
