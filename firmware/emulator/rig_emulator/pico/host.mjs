// SPDX-License-Identifier: GPL-3.0-or-later
// A USB host at rp2040js's USB controller: it asks a device all that an operating system asks of a
// serial port, and then moves bytes, one packet at a time each way.

const PACKET_US = 50; // a full packet takes 43 us on the wire
const READY_US = 45; // the controller tells the device a little before the host has read it
const PACKET = 64;
const DEVICE = 1, CONFIGURATION = 2, TEXT = 3;
const BULK = 2;

function packet(type, request, value, index, length) {
  return Uint8Array.of(type, request, value & 255, value >> 8, index & 255, index >> 8, length & 255, length >> 8);
}

export class Host {
  // `onBytes(bytes)` when a packet of the line has come; `onFault(text)`.
  constructor(rp2040, onBytes, onFault) {
    this.usb = rp2040.usbCtrl;
    this.onBytes = onBytes;
    this.onFault = onFault;
    this.texts = [];
    this.open = true; // somebody has opened the port
    this.ready = false; // enumerated, and the device knows that it is open
    this.plan = [];
    this.transfer = null;
    this.out = []; // bytes for the device
    this.asks = false; // the device has a buffer for them
    this.reads = true; // somebody takes what it sends
    this.untaken = []; // packets that nobody has taken
    this.waits = false; // the device, until its latest packet is taken
    this.bulkIn = this.bulkOut = -1;
    const { usb } = this, { clock } = rp2040;
    usb.readDelayMicroseconds = usb.writeDelayMicroseconds = PACKET_US;
    const tellNow = usb.indicateBufferReady.bind(usb);
    const alarms = Array.from({ length: 16 }, (_, n) => clock.createAlarm(() => tellNow(n, false)));
    usb.indicateBufferReady = (endpoint, out) => {
      if (out) tellNow(endpoint, out);
      else if (endpoint === this.bulkIn && !this.reads) this.waits = true;
      else alarms[endpoint].schedule(READY_US * 1000);
    };
    this.nextTransfer = clock.createAlarm(() => this.begin());
    usb.onUSBEnabled = () => usb.resetDevice();
    usb.onResetReceived = () => this.enumerate();
    usb.onEndpointWrite = (endpoint, data) => this.fromDevice(endpoint, data);
    usb.onEndpointRead = (endpoint) => this.forDevice(endpoint);
  }

  read(type, request, value, index, length, take) {
    this.plan.push({ setup: packet(type, request, value, index, length), length, got: [], take });
  }

  write(type, request, value, index, data = null) {
    this.plan.push({ setup: packet(type, request, value, index, data ? data.length : 0), data, length: 0, got: [] });
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

  // Somebody opens or closes the port.
  setOpen(open) {
    this.open = open;
    if (!open) this.out = [];
    if (this.bulkIn < 0) return;
    this.lines(open);
    if (!this.transfer) this.begin();
  }

  // The program that has opened the port goes on reading, or does not.
  setReads(reads) {
    this.reads = reads;
    if (!reads) return;
    for (const data of this.untaken.splice(0)) this.onBytes(data);
    if (this.waits) this.usb.indicateBufferReady(this.bulkIn, false);
    this.waits = false;
  }

  // A hub lets the bus go, and begins anew.
  resetBus() {
    this.plan = [];
    this.transfer = null;
    this.ready = this.asks = false;
    this.bulkIn = this.bulkOut = -1;
    this.texts = [];
    this.usb.resetDevice();
  }

  setRate(baud) {
    this.write(0x21, 0x20, 0, 0, [baud & 255, (baud >> 8) & 255, (baud >> 16) & 255, 0, 0, 0, 8]);
    if (!this.transfer) this.begin();
  }

  begin() {
    this.transfer = this.plan.shift() ?? null;
    if (this.transfer) this.usb.sendSetupPacket(this.transfer.setup);
  }

  end() {
    const { take, done, got } = this.transfer;
    this.transfer = null;
    if (take) take(got);
    if (done) done();
    this.nextTransfer.schedule(PACKET_US * 1000);
  }

  // The last packet of an answer has come, and the device waits for an empty one.
  thank() {
    if (!this.transfer.complete || !this.transfer.thanks) return;
    this.usb.endpointReadDone(0, new Uint8Array(0), PACKET_US);
    this.end();
  }

  fromDevice(endpoint, data) {
    const { transfer } = this;
    if (endpoint === 0 && transfer) {
      if (!transfer.length) return this.end();
      transfer.got.push(...data);
      transfer.complete = data.length < PACKET || transfer.got.length >= transfer.length;
      this.thank();
    } else if (endpoint === this.bulkIn) {
      if (data.length === PACKET) this.onFault('a full packet: the host would wait for more');
      if (this.reads) this.onBytes(data);
      else this.untaken.push(data);
    }
  }

  forDevice(endpoint) {
    const { transfer } = this;
    if (endpoint === 0 && transfer) {
      if (transfer.data) {
        this.usb.endpointReadDone(0, Uint8Array.from(transfer.data), PACKET_US);
        transfer.data = null;
      } else {
        transfer.thanks = true;
        this.thank();
      }
    } else if (endpoint === this.bulkOut) {
      this.asks = true;
      this.deliver();
    }
  }

  send(bytes) {
    this.out.push(...bytes);
    this.deliver();
  }

  deliver() {
    if (!this.ready || !this.asks || !this.out.length) return;
    this.asks = false;
    this.usb.endpointReadDone(this.bulkOut, Uint8Array.from(this.out.splice(0, PACKET)), PACKET_US);
  }
}
