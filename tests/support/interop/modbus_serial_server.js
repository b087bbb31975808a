// A modbus-serial server that holds registers: node modbus_serial_server.js REGISTERS
"use strict";
const { ServerTCP } = require("modbus-serial");

const size = Number(process.argv[2]);
const registers = new Uint16Array(size);

function held(address) {
  if (address >= size) throw Object.assign(new Error("no such register"), { modbusErrorCode: 2 });
  return address;
}

const vector = {
  getHoldingRegister: (address) => registers[held(address)],
  setRegister: (address, value) => {
    registers[held(address)] = value;
  },
};
// Any port that is free; by the number 0 it takes its own, 502.
const server = new ServerTCP(vector, { host: "127.0.0.1", port: "0", unitID: 1 });
server.on("initialized", () => console.log(`ready ${server._server.address().port}`));
server.on("socketError", () => {}); // a client that goes away is no fault
