// SPDX-License-Identifier: GPL-3.0-or-later
// A Pico at the other end of a pipe: an order a line, an answer a line, both JSON. Started as
// `node run.mjs FIRMWARE.uf2 NUMBER REVISION`; it ends with its input.

import { createInterface } from 'node:readline';

import { Chip, NS, RAM, readUf2 } from './chip.mjs';

const OUTPUTS = [16, 17, 18, 25];

const [, , path, number, revision] = process.argv;
const chip = new Chip(readUf2(path), Buffer.from(number, 'hex'), Number(revision));

function obey(order) {
  if (order.quick !== undefined) chip.pio.quick = order.quick;
  if (order.watched !== undefined) chip.watched = order.watched;
  if (order.open !== undefined) chip.setOpen(order.open);
  if (order.reads !== undefined) chip.host.setReads(order.reads);
  if (order.rate !== undefined) chip.host.setRate(order.rate);
  if (order.hub !== undefined) chip.host.busyHub = order.hub && chip.revision < 2;
  if (order.resetBus) chip.host.resetBus();
  if (order.sleeps !== undefined) chip.host.setSleeps(order.sleeps);
  if (order.hang) chip.host.controller.hang();
  if (order.deadNs !== undefined) chip.host.controller.deadNs = order.deadNs;
  if (order.hostile) Object.assign(chip.host, (chip.hostile = order.hostile));
  if (order.clearHalts) chip.host.clearHalts();
  if (order.setInterface) chip.host.setInterface();
  if (order.dmaLate !== undefined) chip.dmaFrom = order.dmaLate;
  if (order.wear) chip.wear(...order.wear);
  for (const pin of order.clear ?? []) chip.pio.clearEdges(pin);
  for (const [cycle, pin, level] of order.edges ?? []) chip.pio.edge(cycle, pin, level);
  if (order.reset !== undefined) chip.reset(order.reset);
  for (const [at, value] of order.poke ?? []) chip.rp2040.writeUint16(at, value);
  if (order.peek) return { ...state(), memory: Buffer.from(chip.rp2040.sram.subarray(order.peek[0] - RAM, order.peek[1] - RAM)).toString('hex') };
  if (order.ahead) chip.pio.ahead(order.ahead);
  for (const [cycle, hex] of order.bytes ?? []) {
    const bytes = Buffer.from(hex, 'hex');
    const { clock } = chip.rp2040;
    const alarm = clock.createAlarm(() => chip.host.send(bytes));
    alarm.schedule(Math.max(0, (cycle - chip.cycle) * NS));
  }
  chip.stopOnSent = !!order.stopOnSent;
  const why = order.until === undefined ? null : chip.run(order.until);
  return { ...state(), why };
}

// What has come of it since the last answer.
function state() {
  const { cycle, changes, sent, watchdogs, fault, boots } = chip;
  const { texts, ready, late, lost, gaveUp, plugs } = chip.host;
  const outputs = OUTPUTS.reduce((mask, pin) => mask | (chip.output(pin) << pin), 0);
  chip.changes = [];
  chip.sent = [];
  chip.fault = null;
  return { cycle, changes, sent, watchdogs, fault, outputs, texts, usb: { ready, late, lost, gaveUp, plugs, boots }, why: null };
}

for await (const line of createInterface({ input: process.stdin })) {
  let answer;
  try {
    answer = obey(JSON.parse(line));
  } catch (error) {
    answer = { ...state(), fault: String(error.stack) };
  }
  process.stdout.write(`${JSON.stringify(answer)}\n`);
}
