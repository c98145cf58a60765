// An ATmega328P of avr8js with wires on its pins and its UART:
//
//     node run.mjs IMAGE.hex
//
// Each line of stdin is a script, and is answered by a line of stdout:
//
//     {"until": 500000, "stop": ["PB3"], "edges": [{"cycle": 0, "pin": "PD2", "level": false}],
//      "bytes": [{"cycle": 320, "byte": 0}], "eeprom": [{"address": 0, "byte": 97}]}
//     {"cycle": 500001, "stopped": false, "resets": 0, "overruns": 0,
//      "changes": [{"cycle": 42, "pin": "PB5", "high": true}], "sent": [{"cycle": 999, "byte": 0}]}
//
// It runs to the first instruction that begins at `until` or later, or until an output named in
// `stop` changes. Edges and bytes may lie in the future; a byte's cycle is that of its stop bit's
// end, in both directions. An output's cycle is that at which the instruction began.
//
// Two things are mended, and marked: what comes after RETI, and the receive buffer. An interrupt is
// still entered in 2 cycles, where silicon takes 4.
import { readFileSync } from "node:fs";
import { createInterface } from "node:readline";

import * as avr8js from "avr8js";

const HZ = 16e6;
const FLASH_WORDS = 0x4000;
const RAM_START = 0x100;
const RAM_SIZE = 0x800;
const RECEIVE_DEPTH = 3; // two bytes buffered, one in the shift register
const MCUSR = 0x54;
const POWER_ON = 0x01;
const RETI = 0x9518;
const SEI = 0x9478;

function readHex(path) {
  const flash = new Uint8Array(2 * FLASH_WORDS).fill(0xff);
  for (const line of readFileSync(path, "ascii").split(/\s+/).filter(Boolean)) {
    const record = Buffer.from(line.slice(1), "hex");
    if (line[0] !== ":" || record.length !== record[0] + 5 || record.reduce((a, b) => a + b) & 0xff)
      throw new Error(`${path}: damaged: ${line}`);
    if (record[3] === 1) return new Uint16Array(flash.buffer);
    // 32 KB need no extended addresses; record 3 is a start address.
    if (record[3] === 0) flash.set(record.subarray(4, -1), record.readUInt16BE(1));
    else if (record[3] !== 3) throw new Error(`${path}: record type ${record[3]}`);
  }
  throw new Error(`${path} has no end`);
}

const cpu = new avr8js.CPU(readHex(process.argv[2]), RAM_SIZE);
cpu.data.fill(0xc5, RAM_START); // as at power-up: anything
cpu.data[MCUSR] = POWER_ON;

new avr8js.AVRTimer(cpu, avr8js.timer0Config);
new avr8js.AVRTimer(cpu, avr8js.timer1Config);
new avr8js.AVRWatchdog(cpu, avr8js.watchdogConfig, new avr8js.AVRClock(cpu, HZ));
const eeprom = new avr8js.EEPROMMemoryBackend(1024);
new avr8js.AVREEPROM(cpu, eeprom);
const uart = new avr8js.AVRUSART(cpu, avr8js.usart0Config, HZ);

const said = { changes: [], sent: [] };
const due = { edges: [], bytes: [] };
let watched = new Set();
let stopped = false;
let resets = 0;
let overruns = 0;

const reset = cpu.reset.bind(cpu);
cpu.reset = () => {
  resets++; // the watchdog's: avr8js leaves the peripherals as they are, so nobody should go on
  reset();
};

const ports = {};
for (const name of "BCD") {
  const config = avr8js[`port${name}Config`];
  const port = (ports[name] = new avr8js.AVRIOPort(cpu, config));
  let before = 0;
  port.addListener((value) => {
    const driven = cpu.data[config.DDR] & value; // what a compare unit drives is in it
    for (let bit = 0; bit < 8; bit++) {
      if (!(((driven ^ before) >> bit) & 1)) continue;
      const pin = `P${name}${bit}`;
      said.changes.push({ cycle: cpu.cycles, pin, high: Boolean((driven >> bit) & 1) });
      stopped ||= watched.has(pin);
    }
    before = driven;
  });
}

uart.onByteTransmit = (byte) => said.sent.push({ cycle: cpu.cycles + uart.cyclesPerChar, byte });

// avr8js keeps one received byte and a further one goes over it; silicon has a buffer.
const waiting = [];
let received = false;
const { UDR } = avr8js.usart0Config;
const readUdr = cpu.readHooks[UDR];
cpu.readHooks[UDR] = (address) => {
  const value = readUdr(address);
  received = waiting.length > 0;
  if (received) uart.writeByte(waiting.shift(), true);
  return value;
};

function receive(byte) {
  if (!uart.rxEnable) return;
  if (waiting.length + received >= RECEIVE_DEPTH) overruns++;
  else if (received) waiting.push(byte);
  else {
    received = true;
    uart.writeByte(byte, true);
  }
}

function take(events, what) {
  while (events.length && events[0].cycle <= cpu.cycles) what(events.shift());
}

function run(until) {
  stopped = false;
  while (cpu.cycles < until && !stopped) {
    const opcode = cpu.progMem[cpu.pc];
    avr8js.avrInstruction(cpu);
    take(due.edges, ({ pin, level }) => ports[pin[1]].setPin(Number(pin[2]), level));
    take(due.bytes, ({ byte }) => receive(byte));
    // Peripherals, then interrupts, which the data sheet keeps away from the next instruction here.
    if (opcode !== RETI && opcode !== SEI) cpu.tick();
  }
}

function answer(script) {
  for (const { address, byte } of script.eeprom ?? []) eeprom.memory[address] = byte;
  for (const kind of ["edges", "bytes"]) {
    due[kind].push(...(script[kind] ?? []));
    due[kind].sort((a, b) => a.cycle - b.cycle); // stable: what came first stays first
  }
  watched = new Set(script.stop);
  run(script.until);
  const { changes, sent } = said;
  said.changes = [];
  said.sent = [];
  return { cycle: cpu.cycles, stopped, resets, overruns, changes, sent };
}

for await (const line of createInterface({ input: process.stdin }))
  process.stdout.write(`${JSON.stringify(answer(JSON.parse(line)))}\n`);
