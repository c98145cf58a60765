// SPDX-License-Identifier: GPL-3.0-or-later
// A Pico: rp2040js for the processor, memory, timer, DMA, USB and the rest, our own PIO beside it,
// clock by clock, and a flash chip that knows its number.

import { readFileSync } from 'node:fs';
import { RP2040 } from 'rp2040js';

import { Host } from './host.mjs';
import { Pio } from './pio.mjs';

const CLOCK_MHZ = 120;
export const NS = 1000 / CLOCK_MHZ; // in a cycle
export const RAM = 0x20000000;
const FLASH = 0x10000000, BOOT_AT = 0x20041f00, BOOT_SIZE = 256;
const SUPPLY_ADC = 3;
const REGULATED = 3300; // mV
const INPUT_ENABLE = 0x40, PULL_UP = 0x08;
const PIO0 = 6;
const LED = 25;
const DREQ_RX = 4;
const DMA_ABORT = 0x444;
const XOSC_STATUS = 4, XOSC_STARTUP = 12, STABLE = 2 ** 31, CRYSTAL_KHZ = 12000;
// Of the chip's own program: a list of one function, USB boot, which ends the emulation.
const ROM = new Uint32Array([0, 0, 0, 0, 0, 0x20, 0, 0, 0x00304255, 0, 0, 0, 0xbe55be55]), USB_BOOT = 0x55;
const CHIP_ID = 0x0002927; // behind the revision: 1 is B0 or B1, 2 is B2

// A block of registers that only keeps what is written.
class Registers {
  constructor(values = {}) {
    this.values = new Map(Object.entries(values).map(([at, value]) => [Number(at), value]));
  }

  readUint32(offset) {
    return this.values.get(offset) ?? 0;
  }

  writeUint32(offset, value) {
    this.values.set(offset, value >>> 0);
  }

  writeUint32Atomic(offset, value, kind) {
    const old = this.readUint32(offset);
    this.writeUint32(offset, [value, old ^ value, old | value, old & ~value][kind]);
  }
}

// The flash chip behind its interface: its number, byte by byte. As memory it is rp2040js's.
class Flash extends Registers {
  constructor(number) {
    super();
    this.answer = [0, 0, 0, 0, 0, ...number];
    this.at = 0;
    this.command = 0;
  }

  writeUint32(offset, value) {
    if (offset === 0x08) this.at = 0;
    if (offset === 0x60) {
      if (this.at === 0) this.command = value;
      this.given = this.command === 0x4b ? (this.answer[this.at] ?? 0) : 0xff;
      this.at++;
    }
    super.writeUint32(offset, value);
  }

  readUint32(offset) {
    if (offset === 0x28) return 0x0e;
    return offset === 0x60 ? this.given : super.readUint32(offset);
  }
}

// Flash as a UF2 file has it.
export function readUf2(path) {
  const file = readFileSync(path), pieces = [];
  for (let at = 0; at + 512 <= file.length; at += 512) {
    if (file.readUInt32LE(at) !== 0x0a324655) throw new Error(`${path} is no UF2 file`);
    pieces.push([file.readUInt32LE(at + 12) - FLASH, file.subarray(at + 32, at + 32 + file.readUInt32LE(at + 16))]);
  }
  return pieces;
}

export class Chip {
  constructor(flash, number, revision = 2) {
    this.flash = flash;
    this.number = number;
    this.cycle = 0;
    this.watchdogs = 0;
    this.boots = 0; // how often it went over to take firmware
    this.fault = null;
    this.sent = []; // [cycle, bytes]
    this.changes = []; // [cycle, pin, level]
    this.watched = 0;
    this.stopOnSent = false;
    this.stop = null;
    this.restart = null;
    this.supply = 5000;
    this.revision = revision;
    this.pio = null;
    this.hostile = {}; // what the host does wrong
    this.dmaFrom = 0; // the cycle before which DMA takes nothing
    this.power({ chip: 0x100, watchdog: 0 }, null);
  }

  // Start, with the reasons that the chip's registers tell; memory stays as it was.
  power(reasons, memory) {
    if (this.pio) this.catchUp(); // what its outputs did until now
    const began = this.cycle, old = this.pio;
    this.began = began;
    const rp2040 = (this.rp2040 = new RP2040());
    const quiet = () => {};
    rp2040.logger = { debug: quiet, info: quiet, warn: (...what) => this.warn(what), error: (...what) => this.warn(what) };
    for (const [at, data] of this.flash) rp2040.flash.set(data, at);
    if (memory) rp2040.sram.set(memory);
    else rp2040.sram.fill(0xc5);
    const { peripherals } = rp2040;
    rp2040.bootrom.set(ROM);
    rp2040.onBreak = (code) => {
      if (code !== USB_BOOT) return this.fail(`a break ${code}`);
      this.boots++;
      this.host.controller.reset(true);
    };
    peripherals[0x18000] = new Flash(this.number);
    peripherals[0x40018] = new Registers();
    peripherals[0x40030] = new Registers(); // the bus has no queue here
    peripherals[0x40064] = new Registers({ 0x08: reasons.chip });
    const watchdog = peripherals[0x40058];
    peripherals[0x40000] = new Registers({ 0x00: this.revision * 2 ** 28 + CHIP_ID });
    this.connectCrystal(peripherals[0x40024]);
    watchdog.reason = reasons.watchdog;
    watchdog.onWatchdogTrigger = () => {
      this.restart = { chip: reasons.chip, watchdog: 1 };
      this.watchdogs++;
      watchdog.timer.enable = false; // or it would bite again, without end, in this very moment
    };
    rp2040.adc.channelValues[SUPPLY_ADC] = Math.round(((this.supply / 3) * 4096) / REGULATED);
    this.connectPio(old);
    this.connectPins();
    this.host = new Host(rp2040, (data) => this.heard(data), (why) => this.fail(why));
    this.host.open = this.open ?? true;
    Object.assign(this.host, this.hostile);
    // The chip's own boot program: it calls the first 256 bytes from the end of RAM.
    rp2040.sram.set(rp2040.flash.subarray(0, BOOT_SIZE), BOOT_AT - RAM);
    rp2040.core.PC = BOOT_AT;
    rp2040.core.SP = 0x20042000;
    rp2040.core.LR = 0;
    this.restart = null;
  }

  // It takes as long as the program says, and what waits for it waits at one go.
  connectCrystal(crystal) {
    const read = crystal.readUint32.bind(crystal);
    let stable = null;
    crystal.readUint32 = (offset) => {
      const value = read(offset);
      if (offset !== XOSC_STATUS || !(value & STABLE)) return value;
      stable ??= this.cycle + Math.round((read(XOSC_STARTUP) * 256 * CLOCK_MHZ * 1000) / CRYSTAL_KHZ);
      if (this.cycle >= stable) return value;
      this.cycle = Math.max(this.cycle, Math.min(stable, this.until));
      return (value & ~STABLE) >>> 0;
    };
  }

  connectPio(old) {
    const { rp2040 } = this;
    const pio = (this.pio = new Pio(
      (machine) => this.transfer(machine),
      (clock, before, now) => this.outputs(clock, before, now),
    ));
    pio.clock = this.cycle;
    if (old) {
      // The world outside goes on.
      pio.coming = old.coming;
      pio.levels = old.levels;
      if (old.shown) this.outputs(this.cycle, old.shown, 0);
    } else {
      pio.levels = 0;
    }
    const face = {
      readUint32: (offset) => {
        this.catchUp();
        return pio.read(offset);
      },
      writeUint32: (offset, value) => {
        this.catchUp();
        pio.write(offset, value);
      },
      writeUint32Atomic: (offset, value, kind) => {
        this.catchUp();
        const now = kind ? pio.read(offset) : 0;
        pio.write(offset, [value, now ^ value, now | value, now & ~value][kind]);
      },
    };
    rp2040.peripherals[0x50200] = face;
    const { dma } = rp2040, read = dma.readUint32.bind(dma);
    dma.readUint32 = (offset) => {
      this.catchUp();
      return offset === DMA_ABORT ? 0 : read(offset); // it is done at once
    };
  }

  connectPins() {
    const { rp2040 } = this, { gpio, peripherals } = rp2040;
    const settle = () => {
      this.catchUp();
      let inputs = 0, connected = 0;
      gpio.forEach((pin, n) => {
        if (pin.padValue & INPUT_ENABLE) inputs |= 1 << n;
        if ((pin.ctrl & 31) === PIO0) connected |= 1 << n;
      });
      this.pio.inputs = inputs >>> 0;
      this.pio.connected = connected >>> 0;
      this.pio.outputs();
    };
    for (const block of [peripherals[0x40014], peripherals[0x4001c]]) {
      const write = block.writeUint32.bind(block);
      block.writeUint32 = (offset, value) => {
        write(offset, value);
        settle();
      };
    }
    Object.defineProperty(rp2040, 'gpioValues', {
      get: () => {
        this.catchUp();
        return this.pio.seen;
      },
    });
  }

  // DMA takes a word as soon as it is there; rp2040js knows when a channel would be told.
  transfer(machine) {
    if (this.pio.clock < this.dmaFrom) return;
    for (const channel of this.rp2040.dma.channels) {
      if (channel.active && channel.treq === DREQ_RX + machine.index) {
        while (machine.rx.length) {
          const word = machine.rx.shift();
          this.rp2040.writeUint32(channel.writeAddr, word);
          const mask = channel.ringMask;
          channel.writeAddr = ((channel.writeAddr & ~mask) | ((channel.writeAddr + 4) & mask)) >>> 0;
          channel.transCount--;
        }
      }
    }
  }

  outputs(clock, before, now) {
    for (let pin = 0; pin < 30; pin++) {
      if (((before ^ now) >>> pin) & 1) {
        this.changes.push([clock, pin, (now >>> pin) & 1]);
        if ((this.watched >>> pin) & 1) this.stop = 'pin';
      }
    }
  }

  output(pin) {
    if (pin === LED) return (this.rp2040.sio.gpioValue >>> LED) & 1;
    return (this.pio.high >>> pin) & 1;
  }

  heard(data) {
    this.sent.push([this.cycle, Buffer.from(data).toString('hex')]);
    if (this.stopOnSent) this.stop = 'sent';
  }

  warn(what) {
    this.fail(what.join(': '));
  }

  fail(why) {
    this.fault ??= why;
  }

  catchUp() {
    if (this.pio.clock < this.dmaFrom && this.cycle > this.dmaFrom) {
      this.pio.catchUp(this.dmaFrom);
      for (const machine of this.pio.machines) this.transfer(machine);
    }
    if (this.pio.clock < this.cycle) this.pio.catchUp(this.cycle);
  }

  // The clock of rp2040js counts nanoseconds since the start.
  tick() {
    const { clock } = this.rp2040;
    clock.tick((this.cycle - this.began) * NS - clock.nanos);
  }

  nextAlarm() {
    const alarm = this.rp2040.clock.nextAlarm;
    return alarm ? this.began + Math.ceil(alarm.nanos / NS) : Infinity;
  }

  // Let it work up to a cycle; it comes back earlier for a watched pin, or for bytes.
  run(until) {
    this.stop = null;
    this.until = until;
    while (this.cycle < until && !this.stop && !this.fault) {
      if (this.restart) this.power(this.restart, this.rp2040.sram);
      const { core } = this.rp2040;
      if (this.boots) {
        this.cycle = until;
      } else if (core.waiting) {
        this.cycle = Math.max(this.cycle + 1, Math.min(until, this.nextAlarm()));
        this.tick();
      } else {
        this.cycle += core.executeInstruction();
        this.tick();
      }
    }
    this.catchUp();
    return this.stop;
  }

  // The reset pin, or the supply for a moment.
  reset(reason) {
    this.power({ chip: reason, watchdog: 0 }, this.rp2040.sram);
  }

  // DMA has moved so many words of a state machine's that only `left` are to come.
  wear(machine, left) {
    this.rp2040.dma.channels.find((c) => c.active && c.treq === DREQ_RX + machine).transCount = left;
  }

  setOpen(open) {
    this.open = open;
    this.host.setOpen(open);
  }
}
