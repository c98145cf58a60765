// SPDX-License-Identifier: GPL-3.0-or-later
// What rp2040js's USB controller leaves open, for a device: a buffer stays offered until the host has
// it or it is withdrawn, packets have PIDs, frames go by, and the block can hang and be reset.

const AVAILABLE = 1 << 10, FULL = 1 << 15, DATA1 = 1 << 13, SIZE = 0x3ff;
const BUFFERS = 0x80, BUFFERS_END = 0x100;
const FRAME = 0x48, SIE_CTRL = 0x4c;
const PULL_UP = 1 << 16, SUSPENDED = 1 << 4, SETUP = 1 << 17;
const RESET_USB = 1 << 24, RESET = 0, RESET_DONE = 8;
const FRAME_NS = 1e6, SUSPENDED_AFTER_NS = 3e6;

export class Controller {
  // `host` has `offered(key)`, `plugged()` and `unplugged()`. A key is twice the endpoint, plus one for out.
  constructor(rp2040, host) {
    const usb = (this.usb = rp2040.usbCtrl);
    this.rp2040 = rp2040;
    this.host = host;
    this.clock = rp2040.clock;
    this.buffers = new Map(); // what is offered: key to its DATA1
    this.hung = false;
    this.held = false; // in reset
    this.doneAt = 0; // when it is out of it
    this.deadNs = 0; // how long that takes
    this.pulledUp = false;
    this.framesFrom = null;
    this.frozen = 0;
    this.suspend = this.clock.createAlarm(() => {
      if (this.framesFrom === null && !this.hung) usb.sieStatus |= SUSPENDED;
    });
    usb.DPRAMUpdated = (offset, value) => {
      if (offset < BUFFERS || offset >= BUFFERS_END || this.dead()) return;
      const key = (offset - BUFFERS) >> 2;
      if (value & AVAILABLE) {
        this.buffers.set(key, value & DATA1 ? 1 : 0);
        host.offered(key);
      } else {
        this.buffers.delete(key);
      }
    };
    const read = usb.readUint32.bind(usb), write = usb.writeUint32.bind(usb);
    usb.readUint32 = (offset) => (this.dead() ? 0 : offset === FRAME ? this.frame() : read(offset));
    usb.writeUint32 = (offset, value) => {
      if (this.dead()) return; // what is written to a block in reset is lost
      write(offset, value);
      if (offset === SIE_CTRL) this.pull(!!(value & PULL_UP));
    };
    usb.onUSBEnabled = () => {};
    const resets = rp2040.peripherals[0x4000c], set = resets.writeUint32.bind(resets);
    const get = resets.readUint32.bind(resets);
    resets.writeUint32 = (offset, value) => {
      set(offset, value);
      if (offset === RESET) this.reset(!!(value & RESET_USB));
    };
    resets.readUint32 = (offset) => (offset === RESET_DONE && this.dead() ? get(offset) & ~RESET_USB : get(offset));
  }

  dead() {
    return this.held || this.clock.nanos < this.doneAt;
  }

  reset(held) {
    if (held === this.held) return;
    this.held = held;
    this.doneAt = held ? 0 : this.clock.nanos + this.deadNs;
    if (!held) return;
    const { usb } = this;
    usb.mainCtrl = usb.sieCtrl = usb.sieStatus = usb.buffStatus = usb.addrEndp = 0;
    usb.intRaw = usb.intEnable = 0;
    usb.checkInterrupts();
    usb.resetAlarm.cancel();
    this.hung = false;
    this.frozen = 0;
    this.framesFrom = null;
    this.buffers.clear();
    this.pull(false);
  }

  pull(up) {
    if (up === this.pulledUp) return;
    this.pulledUp = up;
    if (up) this.host.plugged();
    else this.host.unplugged();
  }

  // -- frames

  frame() {
    if (this.framesFrom === null || this.hung) return this.frozen;
    return Math.floor((this.clock.nanos - this.framesFrom) / FRAME_NS) & 0x7ff;
  }

  // How far into a frame it is, ns; null when there is none.
  phase() {
    return this.framesFrom === null ? null : (this.clock.nanos - this.framesFrom) % FRAME_NS;
  }

  setFrames(on) {
    this.frozen = this.frame();
    this.framesFrom = on ? this.clock.nanos - this.frozen * FRAME_NS : null;
    if (on) this.usb.sieStatus &= ~SUSPENDED;
    else this.suspend.schedule(SUSPENDED_AFTER_NS);
  }

  // It waits for the end of a packet for ever, as RP2040-E15 has it: nothing moves but the bus.
  hang() {
    this.frozen = this.frame();
    this.hung = true;
  }

  // -- packets

  setup(packet) {
    if (this.hung || this.dead()) return false;
    this.usb.sendSetupPacket(packet);
    return true;
  }

  // Whether a request waits for the device to see it: until then it refuses all else of endpoint 0.
  waits() {
    return !!(this.usb.sieStatus & SETUP);
  }

  offers(key) {
    return this.buffers.has(key) && !this.hung && !this.dead();
  }

  // What the device offers, which stays.
  peek(key) {
    const control = this.control(key), size = control & SIZE;
    const at = this.usb.getEndpointBufferOffset(key >> 1, !!(key & 1));
    return { data: this.rp2040.usbDPRAM.slice(at, at + size), data1: this.buffers.get(key) };
  }

  control(key) {
    return this.rp2040.usbDPRAMView.getUint32(BUFFERS + 4 * key, true);
  }

  // The host has acknowledged it, or the device a packet of the host's: the device is told.
  done(key) {
    const cleared = this.control(key) & ~AVAILABLE & (key & 1 ? ~0 : ~FULL);
    this.rp2040.usbDPRAMView.setUint32(BUFFERS + 4 * key, cleared >>> 0, true);
    this.buffers.delete(key);
    if (!(key & 1)) this.usb.indicateBufferReady(key >> 1, false);
  }

  // A packet of the host's: one with the other PID is acknowledged and forgotten.
  give(key, data, data1) {
    if (this.buffers.get(key) !== data1) return;
    this.done(key);
    this.usb.finishRead(key >> 1, data);
  }
}
