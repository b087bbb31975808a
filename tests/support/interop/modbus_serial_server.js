// A modbus-serial server that holds registers: node modbus_serial_server.js PORT REGISTERS
"use strict";
const { ServerTCP } = require("modbus-serial");

const [port, size] = process.argv.slice(2).map(Number);
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
const server = new ServerTCP(vector, { host: "127.0.0.1", port, unitID: 1 });
server.on("initialized", () => console.log(`ready ${port}`));
server.on("socketError", () => {}); // a client that goes away is no fault
