"""A Modbus TCP server for one block of holding registers: function codes 3, 6 and 16. Standard library only."""

import socketserver
import struct

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3


class ModbusServer(socketserver.ThreadingTCPServer):
    """Serves `mailbox.registers`: reads under `mailbox.lock`, writes by `mailbox.write`.

    What is not in `mailbox.writable` can only be read.
    """

    allow_reuse_address = True
    daemon_threads = True

    def __init__(self, address, mailbox):
        super().__init__(address, _Connection)
        self.mailbox = mailbox


class _Connection(socketserver.StreamRequestHandler):
    timeout = 60  # a client that says nothing for so long is gone: the service speaks at least once a second
    disable_nagle_algorithm = True

    def handle(self):
        try:
            while True:
                head = self.rfile.read(8)
                if len(head) < 8:
                    return
                transaction, protocol, length, unit, function = struct.unpack(">HHHBB", head)
                if protocol != 0 or not 2 <= length <= 254:
                    return  # no Modbus: nothing that follows could be understood
                body = self.rfile.read(length - 2)
                if len(body) < length - 2:
                    return
                reply = answer(self.server.mailbox, function, body)
                self.wfile.write(struct.pack(">HHHB", transaction, 0, len(reply) + 1, unit) + reply)
        except OSError:
            return


def answer(mailbox, function, body):
    """The reply's function code and data; exceptions as the standard has them."""
    try:
        if function == 3:
            start, count = struct.unpack(">HH", body)
            if not 1 <= count <= 125:
                return bytes([function | 0x80, ILLEGAL_VALUE])
            if start + count > len(mailbox.registers):
                return bytes([function | 0x80, ILLEGAL_ADDRESS])
            with mailbox.lock:
                words = mailbox.registers[start : start + count]
            return struct.pack(f">BB{count}H", function, 2 * count, *words)
        if function == 6:
            start, value = struct.unpack(">HH", body)
            return _written(mailbox, function, start, [value], body)
        if function == 16:
            start, count, size = struct.unpack(">HHB", body[:5])
            if not 1 <= count <= 123 or size != 2 * count or len(body) != 5 + size:
                return bytes([function | 0x80, ILLEGAL_VALUE])
            return _written(mailbox, function, start, struct.unpack(f">{count}H", body[5:]), body[:4])
    except struct.error:
        return bytes([function | 0x80, ILLEGAL_VALUE])
    return bytes([function | 0x80, ILLEGAL_FUNCTION])


def _written(mailbox, function, start, words, echo):
    if start not in mailbox.writable or start + len(words) - 1 not in mailbox.writable:
        return bytes([function | 0x80, ILLEGAL_ADDRESS])
    mailbox.write(start, words)
    return bytes([function]) + echo
