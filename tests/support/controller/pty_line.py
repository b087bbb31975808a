"""Two pseudo-terminals joined into a serial line, with hands on what goes over it."""

from __future__ import annotations

import asyncio
import contextlib
import os
import tty
from collections.abc import Callable

Hand = Callable[[bytes], bytes]


class PtyLine:
    """A line between the devices `near` and `far`, which programs open as serial ports; pumped by the running loop.

    towards_far, towards_near: get what goes each way and return what arrives. Use as an async context manager.
    It has no baud rate: bytes arrive at once.
    """

    def __init__(self) -> None:
        self.towards_far: Hand = lambda data: data
        self.towards_near: Hand = lambda data: data
        self._near, self._near_device = os.openpty()
        self._far, self._far_device = os.openpty()
        for device in (self._near_device, self._far_device):
            tty.setraw(device)
        self.near, self.far = os.ttyname(self._near_device), os.ttyname(self._far_device)

    async def __aenter__(self) -> PtyLine:
        loop = asyncio.get_running_loop()
        for master in (self._near, self._far):
            os.set_blocking(master, False)
        loop.add_reader(self._near, self._pump, self._near, lambda data: self.say_to_far(self.towards_far(data)))
        loop.add_reader(self._far, self._pump, self._far, lambda data: self.say_to_near(self.towards_near(data)))
        return self

    async def __aexit__(self, *_: object) -> None:
        self.unplug_near()
        self._close(self._far, self._far_device)

    def say_to_near(self, data: bytes) -> None:
        """Bytes for the near end, from nobody."""
        if data and self._near >= 0:
            os.write(self._near, data)

    def say_to_far(self, data: bytes) -> None:
        """Bytes for the far end, from nobody."""
        if data:
            os.write(self._far, data)

    def unplug_near(self) -> None:
        """Take the near port away, as a USB adapter that is pulled out."""
        if self._near >= 0:
            self._close(self._near, self._near_device)
            self._near = -1

    @staticmethod
    def _pump(master: int, carry: Callable[[bytes], None]) -> None:
        with contextlib.suppress(BlockingIOError):
            carry(os.read(master, 4096))

    @staticmethod
    def _close(master: int, device: int) -> None:
        asyncio.get_running_loop().remove_reader(master)
        os.close(master)
        os.close(device)
