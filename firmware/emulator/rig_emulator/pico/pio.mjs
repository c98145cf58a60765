// SPDX-License-Identifier: GPL-3.0-or-later
// PIO of the RP2040, clock by clock, as its data sheet describes it (chapter 3), with the pins'
// synchronisers. It takes the place of rp2040js's own, which knows no delays and no clock.
//
// It works when it is asked to: whoever wants to know something of it lets it catch up first. A
// machine that goes round in a loop is not stepped through each turn, see `settled`.

const MACHINES = 4;
const SYNCHRONISER = 2; // clocks from a pin to what PIO and processor read
const LOOP = 6; // clocks of the loops that are taken at one go; any other loop is stepped through
const STATE = 5; // numbers that a machine's history keeps of each clock: four registers
const PLACE = 4; // and where in its program it is

const FSTAT = 0x04, FDEBUG = 0x08, TXF = 0x10, RXF = 0x20, MEMORY = 0x48, MACHINE = 0xc8;

class Machine {
  constructor(pio, index) {
    this.pio = pio;
    this.index = index;
    this.enabled = false;
    this.x = this.y = this.isr = this.osr = 0;
    this.pc = 0;
    this.wait = 0; // clocks of delay still to come
    this.tx = [];
    this.rx = [];
    this.stalled = false;
    this.lostWord = false; // a push found no room
    this.wrapTop = 31;
    this.wrapBottom = 0;
    this.jmpPin = 0;
    this.shiftctrl = 3 << 18;
    this.pinctrl = 5 << 26;
    this.execctrl = 31 << 12;
    this.clkdiv = 1 << 16;
    this.history = new Float64Array(2 * LOOP * STATE);
    this.known = 0; // clocks of history without anything from or to the outside
    this.compared = 0;
  }

  get room() {
    return this.shiftctrl & (1 << 31) ? 8 : 4;
  }

  pinsIn() {
    const base = (this.pinctrl >>> 15) & 31;
    const seen = this.pio.seen;
    return base ? ((seen >>> base) | (seen << (32 - base))) >>> 0 : seen >>> 0;
  }

  source(which) {
    switch (which) {
      case 0: return this.pinsIn();
      case 1: return this.x;
      case 2: return this.y;
      case 3: return 0;
      case 6: return this.isr;
      case 7: return this.osr;
      default: throw new Error(`PIO: source ${which} is not modelled`);
    }
  }

  drive(base, count, value, directions) {
    const mask = count === 32 ? 0xffffffff : (1 << count) - 1;
    this.known = 0;
    this.pio.drive((mask << base) >>> 0, ((value & mask) << base) >>> 0, directions);
  }

  // One instruction. Returns whether it is done; otherwise it will be tried again.
  execute(word, delays) {
    const argument = (word >>> 5) & 7, low = word & 31;
    let next = -1;
    switch (word >>> 13) {
      case 0: { // JMP
        let taken = true;
        switch (argument) {
          case 0: break;
          case 1: taken = this.x === 0; break;
          case 2: taken = this.x !== 0; this.x = (this.x - 1) >>> 0; break;
          case 3: taken = this.y === 0; break;
          case 4: taken = this.y !== 0; this.y = (this.y - 1) >>> 0; break;
          case 5: {
            taken = this.x !== this.y;
            const compared = (this.x ^ this.y) >>> 0;
            if (compared !== this.compared) this.known = 0; // it may come out otherwise next time
            this.compared = compared;
            break;
          }
          case 6: taken = !!((this.pio.seen >>> this.jmpPin) & 1); break;
          default: throw new Error('PIO: JMP !OSRE is not modelled');
        }
        if (taken) next = low;
        break;
      }
      case 2: { // IN
        if (this.shiftctrl & (1 << 18)) throw new Error('PIO: shifting in to the right is not modelled');
        const bits = low || 32;
        const value = this.source(argument);
        this.isr = bits === 32 ? value : (((this.isr << bits) | (value & ((1 << bits) - 1))) >>> 0);
        break;
      }
      case 3: { // OUT
        const bits = low || 32;
        const right = this.shiftctrl & (1 << 19);
        if (!right || bits === 32) throw new Error('PIO: such an OUT is not modelled');
        const value = this.osr & ((1 << bits) - 1);
        this.osr = this.osr >>> bits;
        if (argument !== 0 && argument !== 4) throw new Error('PIO: such an OUT is not modelled');
        this.drive(this.pinctrl & 31, (this.pinctrl >>> 20) & 63, value, argument === 4);
        break;
      }
      case 4: // PUSH and PULL
        if (word & 0x80) {
          if (this.tx.length) {
            this.osr = this.tx.shift();
            this.known = 0;
          } else if (word & 0x20) {
            return false;
          } else {
            this.osr = this.x;
          }
        } else {
          this.known = 0;
          if (this.rx.length < this.room) {
            this.rx.push(this.isr);
            this.pio.onReceived(this);
          } else if (word & 0x20) {
            return false;
          } else {
            this.lostWord = true;
          }
          this.isr = 0;
        }
        break;
      case 5: { // MOV
        let value = this.source(low & 7);
        const operation = (low >>> 3) & 3;
        if (operation > 1) throw new Error('PIO: reversing bits is not modelled');
        if (operation) value = ~value >>> 0;
        switch (argument) {
          case 0: this.drive(this.pinctrl & 31, (this.pinctrl >>> 20) & 63, value, false); break;
          case 1: this.x = value; break;
          case 2: this.y = value; break;
          case 6: this.isr = value; break;
          case 7: this.osr = value; break;
          default: throw new Error('PIO: such a MOV is not modelled');
        }
        break;
      }
      case 7: { // SET
        const base = (this.pinctrl >>> 5) & 31, count = (this.pinctrl >>> 26) & 7;
        switch (argument) {
          case 0: this.drive(base, count, low, false); break;
          case 1: this.x = low; break;
          case 2: this.y = low; break;
          case 4: this.drive(base, count, low, true); break;
          default: throw new Error('PIO: such a SET is not modelled');
        }
        break;
      }
      default:
        throw new Error('PIO: WAIT and IRQ are not modelled');
    }
    if (delays) {
      this.wait = (word >>> 8) & 31;
      if (next < 0) next = this.pc === this.wrapTop ? this.wrapBottom : (this.pc + 1) & 31;
    }
    if (next >= 0) this.pc = next;
    return true;
  }

  step() {
    if (this.wait) this.wait--;
    else this.stalled = !this.execute(this.pio.memory[this.pc], true);
    const at = (this.pio.clock % (2 * LOOP)) * STATE, h = this.history;
    h[at] = this.x;
    h[at + 1] = this.y;
    h[at + 2] = this.isr;
    h[at + 3] = this.osr;
    h[at + 4] = this.pc * 32 + this.wait;
    this.known++;
  }

  // How many turns it can go on like this: it was in the same places as one turn ago, and every
  // register was the same or one less. None may come near zero, where a JMP comes out otherwise.
  settled() {
    if (!this.enabled) return Infinity;
    if (this.known < 2 * LOOP) return 0;
    const h = this.history, latest = this.pio.clock - 1;
    let turns = Infinity;
    for (let n = 0; n < LOOP; n++) {
      const newer = ((latest - n) % (2 * LOOP)) * STATE;
      const older = ((latest - n - LOOP) % (2 * LOOP)) * STATE;
      if (h[newer + PLACE] !== h[older + PLACE]) return 0;
      for (let register = 0; register < PLACE; register++) {
        const now = h[newer + register], before = h[older + register];
        if (now === before) continue;
        if (before - now !== 1) return 0;
        turns = Math.min(turns, now - 2 * LOOP);
      }
    }
    return turns;
  }

  // Go on by so many turns, an even number: what a clock's history is does not move then.
  skip(turns) {
    if (!this.enabled) return;
    const h = this.history, half = LOOP * STATE;
    for (let n = 0; n < half; n++) {
      if (h[n] === h[n + half]) continue;
      h[n] -= turns;
      h[n + half] -= turns;
    }
    const now = ((this.pio.clock - 1) % (2 * LOOP)) * STATE;
    this.x = h[now];
    this.y = h[now + 1];
    this.isr = h[now + 2];
    this.osr = h[now + 3];
  }

  forget() {
    this.known = 0;
  }
}

export class Pio {
  // `onReceived(machine)` when there is a word for DMA; `onPins(clock, before, now)` when outputs
  // change, as masks of what is driven high.
  constructor(onReceived, onPins) {
    this.clock = 0;
    this.memory = new Uint16Array(32);
    this.machines = Array.from({ length: MACHINES }, (_, n) => new Machine(this, n));
    this.onReceived = onReceived;
    this.onPins = onPins;
    this.values = this.directions = 0;
    this.connected = 0; // outputs that their pins show
    this.levels = 0; // of the pins, outside
    this.inputs = 0; // pins whose inputs are on
    this.seen = 0;
    this.coming = []; // [clock, pin, level], in order
    this.shown = 0;
    this.looped = []; // [clock, outputs], on their way back through the synchronisers
    this.driving = 0;
    this.quick = true; // take loops at one go
  }

  get high() {
    return (this.values & this.directions & this.connected) >>> 0;
  }

  drive(mask, value, directions) {
    if (directions) this.directions = ((this.directions & ~mask) | value) >>> 0;
    else this.values = ((this.values & ~mask) | value) >>> 0;
    this.outputs();
  }

  outputs() {
    const high = this.high;
    if (high !== this.shown) {
      this.onPins(this.clock, this.shown, high);
      this.shown = high;
      this.looped.push([this.clock + SYNCHRONISER, high]);
    }
  }

  edge(clock, pin, level) {
    const due = Math.max(clock, this.clock) + SYNCHRONISER;
    let at = this.coming.length;
    while (at && this.coming[at - 1][0] > due) at--;
    this.coming.splice(at, 0, [due, pin, level]);
  }

  clearEdges(pin) {
    this.coming = this.coming.filter((edge) => edge[1] !== pin);
  }

  look() {
    const driven = (this.directions & this.connected) >>> 0;
    const seen = (((this.levels & ~driven) | (this.driving & driven)) & this.inputs) >>> 0;
    if (seen !== this.seen) {
      this.seen = seen;
      for (const machine of this.machines) machine.forget();
    }
  }

  // Let the machines that stamp, which count in OSR, be so many turns further.
  ahead(turns) {
    for (const machine of this.machines.slice(0, 2)) {
      machine.osr = (machine.osr - turns) >>> 0;
      if (machine.pc === 4 || machine.pc === 5) machine.y = (machine.y - turns) >>> 0; // in between
      machine.forget();
    }
  }

  nextInput() {
    const edge = this.coming.length ? this.coming[0][0] : Infinity;
    const loop = this.looped.length ? this.looped[0][0] : Infinity;
    return Math.min(edge, loop);
  }

  catchUp(until) {
    const { machines } = this;
    while (this.clock < until) {
      while (this.coming.length && this.coming[0][0] <= this.clock) {
        const [, pin, level] = this.coming.shift();
        this.levels = (level ? this.levels | (1 << pin) : this.levels & ~(1 << pin)) >>> 0;
      }
      while (this.looped.length && this.looped[0][0] <= this.clock) this.driving = this.looped.shift()[1];
      this.look();
      const quiet = Math.min(until, this.nextInput());
      while (this.clock < quiet) {
        let turns = this.quick ? Math.floor((quiet - this.clock) / LOOP) : 0;
        for (let n = 0; turns > 1 && n < MACHINES; n++) turns = Math.min(turns, machines[n].settled());
        turns -= turns % 2;
        if (turns > 0) {
          for (const machine of machines) machine.skip(turns);
          this.clock += turns * LOOP;
          continue;
        }
        for (let n = 0; n < MACHINES; n++) if (machines[n].enabled) machines[n].step();
        this.clock++;
        if (this.looped.length && this.looped[0][0] < quiet) break;
      }
    }
  }

  read(offset) {
    if (offset === 0) return this.machines.reduce((mask, m) => mask | (m.enabled ? 1 << m.index : 0), 0);
    if (offset === FSTAT) {
      let status = 0;
      for (const m of this.machines) {
        if (m.rx.length >= m.room) status |= 1 << m.index;
        if (!m.rx.length) status |= 1 << (8 + m.index);
        if (m.tx.length >= 4) status |= 1 << (16 + m.index);
        if (!m.tx.length) status |= 1 << (24 + m.index);
      }
      return status >>> 0;
    }
    if (offset === FDEBUG) return this.machines.reduce((mask, m) => mask | (m.lostWord ? 1 << m.index : 0), 0);
    if (offset >= RXF && offset < RXF + 16) {
      const machine = this.machines[(offset - RXF) >> 2];
      machine.forget();
      return machine.rx.length ? machine.rx.shift() : 0;
    }
    throw new Error(`PIO: reading register ${offset.toString(16)} is not modelled`);
  }

  write(offset, value) {
    value >>>= 0;
    if (offset === 0) {
      for (const m of this.machines) {
        m.enabled = !!((value >>> m.index) & 1);
        m.forget();
      }
    } else if (offset === FDEBUG) {
      for (const m of this.machines) if ((value >>> m.index) & 1) m.lostWord = false;
    } else if (offset >= TXF && offset < TXF + 16) {
      const machine = this.machines[(offset - TXF) >> 2];
      if (machine.tx.length < 4) machine.tx.push(value);
      machine.forget();
    } else if (offset >= MEMORY && offset < MEMORY + 128) {
      this.memory[(offset - MEMORY) >> 2] = value;
    } else if (offset >= MACHINE && offset < MACHINE + 0x18 * MACHINES) {
      const m = this.machines[Math.floor((offset - MACHINE) / 0x18)];
      m.forget();
      switch ((offset - MACHINE) % 0x18) {
        case 0x00:
          if (value !== 1 << 16) throw new Error('PIO: a slower clock is not modelled');
          break;
        case 0x04:
          m.wrapBottom = (value >>> 7) & 31;
          m.wrapTop = (value >>> 12) & 31;
          m.jmpPin = (value >>> 24) & 31;
          break;
        case 0x08:
          m.shiftctrl = value;
          break;
        case 0x10:
          m.execute(value, false);
          break;
        case 0x14:
          m.pinctrl = value;
          break;
        default:
          throw new Error('PIO: this register is not modelled');
      }
    } else {
      throw new Error(`PIO: writing register ${offset.toString(16)} is not modelled`);
    }
  }
}
