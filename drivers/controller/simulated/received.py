"""One request as the simulated controller's server received it, and the function codes that the protocol uses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

FramingName = Literal["tcp", "rtu"]

READ, WRITE_ONE, WRITE_MANY = 3, 6, 16


@dataclass(frozen=True)
class ReceivedRequest:
    """One request: the device that it is for, function code and data, and the TCP transaction that its reply names."""

    unit: int
    pdu: bytes
    transaction: int = 0
