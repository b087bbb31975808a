"""A pyModbusTCP server that holds registers: `python pymodbustcp_server.py PORT REGISTERS`; port 0 takes a free one."""

from __future__ import annotations

import sys
import threading

from pyModbusTCP.server import DataBank, ModbusServer

port, registers = map(int, sys.argv[1:])
bank = DataBank(coils_size=0, d_inputs_size=0, i_regs_size=0, h_regs_size=registers)
server = ModbusServer("127.0.0.1", port, no_block=True, data_bank=bank)
server.start()
print("ready", server._service.server_address[1], flush=True)
threading.Event().wait()
