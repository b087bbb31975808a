"""A pymodbus server that holds registers: `python pymodbus_server.py WAY DEVICE REGISTERS`.

WAY: tcp or rtu-over-tcp, on a free port of loopback, or rtu. DEVICE: the serial port for rtu, else anything.
"""

from __future__ import annotations

import asyncio
import sys

from pymodbus.framer import FramerType
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice


async def serve(way: str, device: str, registers: int) -> None:
    held = SimDevice(1, simdata=[SimData(0, count=registers, datatype=DataType.REGISTERS)])
    server: ModbusSerialServer | ModbusTcpServer
    if way == "rtu":
        server = ModbusSerialServer(held, port=device, baudrate=115_200)
        await server.serve_forever(background=True)
        await asyncio.sleep(0.1)  # it takes the port into its loop after that
        print("ready", 0, flush=True)
    else:
        framer = FramerType.RTU if way == "rtu-over-tcp" else FramerType.SOCKET
        server = ModbusTcpServer(held, framer=framer, address=("127.0.0.1", 0))
        await server.serve_forever(background=True)
        print("ready", server.transport.sockets[0].getsockname()[1], flush=True)
    await server.serving


asyncio.run(serve(sys.argv[1], sys.argv[2], int(sys.argv[3])))
