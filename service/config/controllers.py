"""`controller` of config.yaml: the cutting machine's controller, and how the service speaks with it."""

from __future__ import annotations

from itertools import combinations
from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from drivers.controller.mailbox.blocks import BLOCK_REGISTERS
from drivers.controller.mailbox.pages import HEADER_REGISTERS
from drivers.controller.mailbox.part_block import PART_HEADER_REGISTERS
from service.config.values import REGISTERS, Host, Model, Port, Register, Seconds


class NoController(Model):
    """No controller: contours are traced and go nowhere; the journal keeps a summary of each job."""

    kind: Literal["none"]
    ready_timeout_s: Seconds = Field(30, description="Longest wait for the service to be ready, s.")


class PartBlock(Model):
    """The block by which a controller gets a recipe's parts in their place in the contour."""

    address: Register = Field(2048, description="First register of the part block (PDU address).")
    capacity: int = Field(
        2000, ge=24, le=REGISTERS, description="Registers behind its header: 12 a part, 2 a ring, 4 a vertex."
    )


class ModbusController(Model):
    """What all controllers on Modbus share."""

    device_id: int = Field(1, ge=1, le=255, description="Modbus device id (unit); 0, a broadcast, is never answered.")
    word_order: Literal["big", "little"] = Field(
        "big", description="Order of the two registers of a 32-bit value: big = ABCD, little = CDAB."
    )
    handshake: Literal["full", "none"] = Field(
        "full", description="none: a controller that cannot answer; jobs end as written, never as accepted."
    )
    mode: Literal["send", "observe"] = Field(
        "send", description="observe: make every contour and write nothing, to run beside an old process."
    )
    readback: bool = Field(True, description="Read each page back before it is committed.")
    link_address: Register = Field(
        0, description="First register of the block that the controller writes (PDU address)."
    )
    service_address: Register = Field(
        16, description="First register of the block that the service writes (PDU address)."
    )
    contour_address: Register = Field(32, description="First register of header and payload (PDU address).")
    payload_capacity: int = Field(1984, ge=8, le=REGISTERS, description="Registers of payload, an even number.")
    part_block: PartBlock | None = Field(
        None, description="Keys below; none = a controller that is told nothing of parts."
    )
    longest_write: int = Field(
        123,
        ge=16,
        le=123,
        description="Most registers in one write; blocks of 16 go whole, the standard's most is 123.",
    )
    longest_read: int = Field(
        125, ge=16, le=125, description="Most registers in one read; blocks of 16 go whole, the standard's most is 125."
    )
    single_write: Literal["fc6", "fc16"] = Field(
        "fc6", description="How `transfer` is written; fc16 (of one register): for a controller without FC6."
    )
    timeout_s: Seconds = Field(1.0, description="Longest wait for the reply to one request, s.")
    poll_period_s: float = Field(0.05, ge=0.001, le=0.5, description="Period of looking at the controller's block, s.")
    heartbeat_timeout_s: float = Field(
        3.0, ge=1.0, le=3600, description="Longest time without a change of the controller's heartbeat, s."
    )
    ready_timeout_s: Seconds = Field(30, description="Longest wait for the controller to be ready for a contour, s.")
    ack_timeout_s: Seconds = Field(5, description="Longest wait for the answer to a page, s.")
    max_repeats: int = Field(3, ge=1, le=100, description="Attempts in vain after which a job is withdrawn.")
    valid_for_s: float = Field(
        30, ge=0, le=86_400, description="Age at which the controller refuses a contour, s; 0 = no limit."
    )
    job_timeout_s: Seconds = Field(120, description="Longest wait to deliver a contour where valid_for_s is 0, s.")

    @field_validator("payload_capacity")
    @classmethod
    def _even(cls, value: int) -> int:
        if value % 2:
            raise ValueError(f"is {value}, expected an even number: 32-bit values take two registers")
        return value

    @model_validator(mode="after")
    def _blocks_fit_and_are_apart(self) -> Self:
        blocks = {
            "link_address": (self.link_address, BLOCK_REGISTERS),
            "service_address": (self.service_address, BLOCK_REGISTERS),
            "contour_address": (self.contour_address, 1 + HEADER_REGISTERS + self.payload_capacity),
        }
        if self.part_block is not None:
            blocks["part_block"] = (self.part_block.address, PART_HEADER_REGISTERS + self.part_block.capacity)
        for name, (start, length) in blocks.items():
            if start + length > REGISTERS:
                raise ValueError(f"{name} {start} and {length} registers end at {start + length - 1}, past 65535")
        for (one, (start, length)), (other, (other_start, other_length)) in combinations(blocks.items(), 2):
            if start < other_start + other_length and other_start < start + length:
                raise ValueError(
                    f"{one} ({start} to {start + length - 1}) and {other} "
                    f"({other_start} to {other_start + other_length - 1}) overlap"
                )
        return self

    @model_validator(mode="after")
    def _an_answer_can_be_seen_in_time(self) -> Self:
        if self.ack_timeout_s <= self.poll_period_s:
            raise ValueError(f"ack_timeout_s is {self.ack_timeout_s:g}, expected more than poll_period_s")
        return self


class ModbusTcp(ModbusController):
    """A controller over Modbus TCP."""

    kind: Literal["modbus-tcp"]
    device_id: int = Field(
        1, ge=0, le=255, description="Modbus device id (unit); 0 and 255: the device itself, behind no gateway."
    )
    host: Host = Field("127.0.0.1", description="Host name or address of the controller.")
    port: Port = Field(502, description="TCP port.")


class Rs485(Model):
    """A transceiver that the kernel's driver switches between sending and receiving by RTS."""

    rts_level_for_tx: bool = Field(True, description="Level of RTS while sending.")
    rts_level_for_rx: bool = Field(False, description="Level of RTS while receiving.")
    delay_before_tx_s: float = Field(0, ge=0, le=1, description="From RTS to the first character, s.")
    delay_before_rx_s: float = Field(0, ge=0, le=1, description="From the last character to RTS, s.")


class ModbusRtu(ModbusController):
    """A controller over Modbus RTU on a serial port."""

    kind: Literal["modbus-rtu"]
    port: str = Field(min_length=1, description="Serial port; one below /dev/serial/by-id keeps its name.")
    baudrate: int = Field(115_200, ge=300, le=4_000_000, description="Baud rate.")
    parity: Literal["N", "E", "O"] = Field("N", description="Parity.")
    stop_bits: Literal[1, 2] = Field(1, description="Stop bits.")
    rs485: Rs485 | None = Field(
        None, description="Keys below; none = RS-232, or a converter that switches its transceiver itself."
    )
    echo: bool = Field(False, description="What is sent comes back, as on two wires with a receiver that stays on.")


class ModbusRtuOverTcp(ModbusController):
    """A controller over Modbus RTU frames in a TCP connection (a serial server)."""

    kind: Literal["modbus-rtu-over-tcp"]
    host: Host = Field("127.0.0.1", description="Host name or address of the serial server.")
    port: Port = Field(4001, description="TCP port.")
    baudrate: int = Field(
        9600, ge=300, le=4_000_000, description="Baud rate of the line behind the serial server: silence and time-outs."
    )


Controller = Annotated[NoController | ModbusTcp | ModbusRtu | ModbusRtuOverTcp, Field(discriminator="kind")]
