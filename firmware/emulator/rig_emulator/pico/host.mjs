// SPDX-License-Identifier: GPL-3.0-or-later
// A USB host at the Pico's controller: it asks a device all that an operating system asks of a serial
// port, and then moves bytes, one packet at a time each way. It compares PIDs, and can be hostile.

import { Controller } from './usb.mjs';

const PACKET_US = 50; // a full packet takes 43 us on the wire
const READY_US = 45; // the controller tells the device a little before the host has read it
const AGAIN_US = 5; // after a refusal
const DEBOUNCE_MS = 100; // what comes back is left alone so long, as by Linux
const LATE_NS = 0.8e6; // of a frame: what is offered then could hang the controller
const PACKET = 64;
const DEVICE = 1, CONFIGURATION = 2, TEXT = 3;
const BULK = 2;
const IN = 0, OUT = 1; // keys of endpoint 0

function packet(type, request, value, index, length) {
  return Uint8Array.of(type, request, value & 255, value >> 8, index & 255, index >> 8, length & 255, length >> 8);
}

export class Host {
  // `onBytes(bytes)` when a packet of the line has come; `onFault(text)`.
  constructor(rp2040, onBytes, onFault) {
    this.onBytes = onBytes;
    this.onFault = onFault;
    this.open = true; // somebody has opened the port
    this.reads = true; // somebody takes what it sends
    this.loses = 0; // each how-many-th acknowledgement is lost; 0: none
    this.givesUp = 0; // each how-many-th control transfer is begun anew in its midst
    this.acknowledged = this.requests = 0;
    this.lost = this.gaveUp = 0; // how many in all
    this.late = 0; // packets that were offered at a frame's end
    this.plugs = 0; // how often it came
    this.busyHub = false; // the device misses the end of a bus reset
    const { clock } = rp2040;
    this.clock = clock;
    this.controller = new Controller(rp2040, this);
    this.usb = rp2040.usbCtrl;
    this.forget();
    this.taking = Array.from({ length: 32 }, (_, key) => clock.createAlarm(() => this.take(key)));
    this.giving = Array.from({ length: 32 }, (_, key) => clock.createAlarm(() => this.give(key)));
    this.coming = Array.from({ length: 32 }, () => []);
    this.come = Array.from({ length: 32 }, (_, key) => clock.createAlarm(() => this.arrived(key)));
    this.nextTransfer = clock.createAlarm(() => {
      if (!this.transfer) this.begin();
    });
    this.attach = clock.createAlarm(() => this.resetDevice());
    this.usb.onResetReceived = () => {
      this.controller.setFrames(true);
      this.enumerate();
    };
  }

  forget() {
    this.plan = [];
    this.transfer = null;
    this.out = []; // bytes for the device
    this.sending = null; // the packet of them that it has not acknowledged
    this.onItsWay = false;
    this.texts = [];
    this.ready = false; // enumerated, and the device knows that it is open
    this.bulkIn = this.bulkOut = -1;
    this.configured = false; // and only then is anything asked of them
    this.data1 = new Map(); // of the next packet, by key
    this.seen = new Set(); // keys whose packet has come, but not its acknowledgement to the device
  }

  // -- the plug

  plugged() {
    if (this.plugs++) this.attach.schedule(DEBOUNCE_MS * 1e6);
    else this.resetDevice();
  }

  unplugged() {
    this.attach.cancel();
    this.controller.setFrames(false);
    for (const alarm of [...this.taking, ...this.giving]) alarm.cancel();
    this.nextTransfer.cancel();
    this.forget();
  }

  resetDevice() {
    if (!this.busyHub) this.usb.resetDevice();
  }

  // A hub lets the bus go, and begins anew.
  resetBus() {
    this.forget();
    this.resetDevice();
  }

  // The bus sleeps, or goes on.
  setSleeps(sleeps) {
    this.controller.setFrames(!sleeps);
  }

  // -- what it asks

  read(type, request, value, index, length, take) {
    this.plan.push({ setup: packet(type, request, value, index, length), length, take });
  }

  write(type, request, value, index, data = null, before = null) {
    this.plan.push({ setup: packet(type, request, value, index, data ? data.length : 0), data, length: 0, before });
  }

  enumerate() {
    this.read(0x80, 6, DEVICE << 8, 0, 64, (d) => {
      if (d.length !== 18 || d[7] !== PACKET) this.onFault(`device descriptor ${d}`);
    });
    this.write(0x00, 5, 1, 0);
    this.read(0x80, 6, DEVICE << 8, 0, 18, (d) => {
      this.vendor = d[8] | (d[9] << 8);
      this.product = d[10] | (d[11] << 8);
    });
    this.read(0x80, 6, CONFIGURATION << 8, 0, 9, (d) => this.readConfiguration(d[2] | (d[3] << 8)));
    this.begin();
  }

  readConfiguration(size) {
    this.read(0x80, 6, CONFIGURATION << 8, 0, size, (d) => {
      if (d.length !== size) this.onFault(`configuration of ${d.length} bytes, not ${size}`);
      for (let at = 0; at < d.length; at += d[at]) {
        if (!d[at]) return this.onFault('a descriptor of no size');
        if (d[at + 1] === 5 && (d[at + 3] & 3) === BULK) {
          if (d[at + 2] & 0x80) this.bulkIn = d[at + 2] & 15;
          else this.bulkOut = d[at + 2];
        }
      }
    });
    for (let n = 1; n <= 3; n++) {
      this.read(0x80, 6, (TEXT << 8) | n, 0x0409, 255, (d) => {
        this.texts.push(Buffer.from(d.slice(2)).toString('utf16le'));
      });
    }
    this.write(0x00, 9, 1, 0);
    this.plan.at(-1).done = () => {
      this.configured = true;
      this.offered(2 * this.bulkIn);
    };
    this.write(0x21, 0x20, 0, 0, [0x20, 0xa1, 0x07, 0, 0, 0, 8]);
    this.lines(this.open);
  }

  lines(open) {
    this.write(0x21, 0x22, open ? 3 : 0, 0);
    this.plan[this.plan.length - 1].done = () => {
      this.ready = open;
      if (open) this.deliver();
    };
  }

  ask(how) {
    if (this.bulkIn < 0) return;
    how();
    if (!this.transfer) this.begin();
  }

  // Somebody opens or closes the port.
  setOpen(open) {
    this.open = open;
    if (!open) this.out = [];
    this.ask(() => this.lines(open));
  }

  setRate(baud) {
    this.ask(() => this.write(0x21, 0x20, 0, 0, [baud & 255, (baud >> 8) & 255, (baud >> 16) & 255, 0, 0, 0, 8]));
  }

  // As after a packet that came to nothing: both sides count from DATA0.
  clearHalts() {
    for (const [key, endpoint] of [[2 * this.bulkIn, 0x80 | this.bulkIn], [2 * this.bulkOut + 1, this.bulkOut]]) {
      this.ask(() => this.write(0x02, 1, 0, endpoint, null, () => this.data1.set(key, 0)));
    }
  }

  setInterface() {
    const both = () => this.data1.set(2 * this.bulkIn, 0).set(2 * this.bulkOut + 1, 0);
    this.ask(() => this.write(0x01, 11, 0, 1, null, both));
  }

  // The program that has opened the port goes on reading, or does not.
  setReads(reads) {
    this.reads = reads;
    if (reads) this.offered(2 * this.bulkIn);
  }

  // -- control transfers

  begin() {
    const transfer = (this.transfer = this.plan.shift() ?? null);
    if (!transfer) return;
    if (transfer.before) transfer.before();
    Object.assign(transfer, { got: [], left: transfer.data, complete: !transfer.length, steps: 0 });
    this.data1.set(IN, 1).set(OUT, 1);
    this.seen.delete(IN);
    if (!this.controller.setup(transfer.setup)) return;
    transfer.last = Infinity; // the step before which it is given up
    if (this.givesUp && ++this.requests % this.givesUp === 0) {
      transfer.last = this.gaveUp % 3;
      if (transfer.last === 0) return this.giveUp();
    }
    this.offered(IN);
    this.offered(OUT);
  }

  // Whether the host goes on with its transfer. Else the buffers of the old one stay.
  goesOn() {
    if (++this.transfer.steps < this.transfer.last) return true;
    this.giveUp();
    return false;
  }

  // Another request comes before it is tried again, so that an old answer would be seen.
  giveUp() {
    this.gaveUp++;
    this.plan.unshift(this.transfer);
    this.read(0x80, 8, 0, 0, 1, (d) => {
      if (d.length !== 1) this.onFault(`GET_CONFIGURATION is answered with ${d}`);
    });
    this.plan.unshift(this.plan.pop());
    this.transfer = null;
    this.nextTransfer.schedule(3 * PACKET_US * 1000); // the device is at it meanwhile
  }

  end() {
    const { take, done, got } = this.transfer;
    this.transfer = null;
    if (take) take(got);
    if (done) done();
    this.nextTransfer.schedule(PACKET_US * 1000);
  }

  // What it wants of endpoint 0 now.
  wants(key) {
    const { transfer } = this;
    if (!transfer) return false;
    if (key === IN) return transfer.length ? !transfer.complete : !transfer.left;
    return transfer.length ? transfer.complete : !!transfer.left;
  }

  // -- packets

  // The device has a buffer for a packet, or with one.
  offered(key) {
    if (key < 0 || !this.controller.offers(key)) return;
    if (key >> 1 === this.bulkIn && !(key & 1) && this.controller.phase() >= LATE_NS) this.late++;
    if (key === 2 * this.bulkOut + 1) this.deliver();
    else if (key & 1) this.giving[key].schedule(PACKET_US * 1000);
    else this.taking[key].schedule(READY_US * 1000);
  }

  take(key) {
    const { controller } = this;
    if (!controller.offers(key) || (key !== IN && !this.configured)) return;
    if (key === IN && controller.waits()) return this.taking[key].schedule(AGAIN_US * 1000);
    if (key === IN ? !this.wants(IN) : !this.reads) return;
    const { data, data1 } = controller.peek(key), expected = this.data1.get(key) ?? 0;
    if (data1 !== expected) {
      // It is the one before, whose acknowledgement was lost, or else one that is lost now.
      if (!this.seen.has(key)) this.onFault(`a packet of the wrong PID at key ${key}, of ${data.length} bytes`);
    } else {
      this.data1.set(key, 1 - expected);
      this.coming[key].push(data);
      this.come[key].schedule((PACKET_US - READY_US) * 1000);
    }
    this.seen.delete(key);
    if (this.losesThis()) {
      this.seen.add(key);
      this.taking[key].schedule(PACKET_US * 1000);
    } else {
      controller.done(key);
    }
  }

  losesThis() {
    const loses = !!this.loses && ++this.acknowledged % this.loses === 0;
    if (loses) this.lost++;
    return loses;
  }

  arrived(key) {
    const packets = this.coming[key].splice(0);
    for (const data of packets) {
      if (key === IN) this.answered(data);
      else if (key === 2 * this.bulkIn) this.bytes(data);
    }
  }

  answered(data) {
    const { transfer } = this;
    if (!transfer || !this.goesOn()) return;
    if (!transfer.length) return this.end();
    transfer.got.push(...data);
    transfer.complete = data.length < PACKET || transfer.got.length >= transfer.length;
    if (transfer.complete) this.offered(OUT);
  }

  bytes(data) {
    if (data.length === PACKET) this.onFault('a full packet: the host would wait for more');
    this.onBytes(data);
  }

  // A packet for the device.
  give(key) {
    const { controller, transfer } = this;
    if (key !== OUT) this.onItsWay = false;
    if (!controller.offers(key)) return;
    if (key === OUT) {
      if (controller.waits()) return this.giving[key].schedule(AGAIN_US * 1000);
      if (!this.wants(OUT) || !this.goesOn()) return;
      controller.give(OUT, Uint8Array.from(transfer.left ?? []), 1);
      if (transfer.length) this.end();
      else {
        transfer.left = null;
        this.offered(IN);
      }
    } else if (this.sending) {
      const data1 = this.data1.get(key) ?? 0;
      controller.give(key, this.sending, data1);
      if (this.losesThis()) return; // and it is sent again when there is a buffer
      this.data1.set(key, 1 - data1);
      this.sending = null;
      this.deliver();
    }
  }

  send(bytes) {
    this.out.push(...bytes);
    this.deliver();
  }

  deliver() {
    const key = 2 * this.bulkOut + 1;
    if (!this.ready || !this.controller.offers(key)) return;
    if (!this.sending && this.out.length) this.sending = Uint8Array.from(this.out.splice(0, PACKET));
    if (!this.sending || this.onItsWay) return;
    this.onItsWay = true;
    this.giving[key].schedule(PACKET_US * 1000);
  }
}
