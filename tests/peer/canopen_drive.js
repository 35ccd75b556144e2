// A CiA 402 drive whose CANopen is that of npm's `canopen`: node canopen_drive.js NODE_ID. Frames are lines "201#0600" on
// standard input and output; the lines "fault", "mute" and "hear" make trouble. Each change of state is a line on standard error.
'use strict';
const Module = require('module');
const load = Module._load;
// Native code for the checksums of block transfers alone, which nobody asks for here.
Module._load = (name, ...rest) => (name === 'node-crc' ? {} : load(name, ...rest));
const { Device, DataType, ObjectType, AccessType } = require('canopen');

const id = Number(process.argv[2]);
const device = new Device({ id });
const eds = device.eds;
const { INTEGER8, INTEGER16, INTEGER32, UNSIGNED8, UNSIGNED16, UNSIGNED32, VISIBLE_STRING } = DataType;
const variable = (index, dataType, defaultValue = 0, accessType = AccessType.READ_WRITE) => {
  const entry = eds.getEntry(index) || eds.addEntry(index, { parameterName: index.toString(16), dataType });
  Object.assign(entry, { accessType, defaultValue, value: defaultValue });
};
const record = (index, subs) => {
  const entry = eds.getEntry(index) || eds.addEntry(index, { parameterName: index.toString(16), objectType: ObjectType.RECORD });
  for (const [sub, dataType, value] of subs)
    entry.addSubObject(sub, { parameterName: `${index.toString(16)}.${sub}`, dataType }).value = value;
};
const pdo = (communication, cobId) => {
  record(communication, [[1, UNSIGNED32, cobId], [2, UNSIGNED8, 1]]);
  record(communication + 0x200, [1, 2, 3, 4].map((sub) => [sub, UNSIGNED32, 0]));
  eds.getEntry(communication + 0x200)[0].value = 0;
};

const RO = AccessType.READ_ONLY;
variable(0x1000, UNSIGNED32, 0x20192, RO);
variable(0x1008, VISIBLE_STRING, 'a drive on canopen from npm', RO);
variable(0x2000, VISIBLE_STRING, '-');
eds.setSyncCobId(0x80, { saveDefault: true });  // values that a reset brings back
eds.setEmcyCobId(0x80 + id, { saveDefault: true });
eds.addSdoServerParameter(0, 0x580 + id, 0x600 + id);
variable(0x1017, UNSIGNED16);
record(0x1016, [[1, UNSIGNED32, 0]]);
pdo(0x1400, 0x200 + id);
pdo(0x1800, 0x180 + id);
pdo(0x1801, 0x80000280 + id);
variable(0x6007, INTEGER16);
variable(0x6040, UNSIGNED16);
variable(0x6041, UNSIGNED16, 0x250, RO);
variable(0x605a, INTEGER16, 2);
variable(0x6060, INTEGER8);
variable(0x6061, INTEGER8, 0, RO);
variable(0x6064, INTEGER32, 16000, RO);
variable(0x606c, INTEGER32, 0, RO);
variable(0x6077, INTEGER16, 0, RO);
variable(0x607a, INTEGER32, 0);
variable(0x607f, UNSIGNED32, 100000000, RO);
variable(0x6085, UNSIGNED32, 1000);
variable(0x6502, UNSIGNED32, 0x80, RO);
record(0x607d, [[1, INTEGER32, 0], [2, INTEGER32, 0]]);
record(0x60c2, [[1, UNSIGNED8, 1], [2, INTEGER8, -2]]);

// States and what a controlword makes of them: [mask, bits, next state].
const states = {
  disabled: { word: 0x250, next: [[0x87, 0x06, 'ready']] },
  ready: { word: 0x231, next: [[0x82, 0, 'disabled'], [0x86, 2, 'disabled'], [0x87, 7, 'switched on']] },
  'switched on': { word: 0x233, next: [[0x82, 0, 'disabled'], [0x86, 2, 'disabled'], [0x87, 6, 'ready'], [0x8f, 0xf, 'enabled']] },
  enabled: { word: 0x1237, next: [[0x82, 0, 'disabled'], [0x86, 2, 'quick stop'], [0x87, 6, 'ready'], [0x8f, 7, 'switched on']] },
  'quick stop': { word: 0x217, next: [[0x82, 0, 'disabled']] },
  fault: { word: 0x218, next: [] },
};
let state = 'disabled';
let last = 0;
let mute = false;
const set = (index, value) => { eds.getEntry(index).value = value; };
const enter = (next) => {
  state = next;
  set(0x6041, states[state].word);
  process.stderr.write(`${state}\n`);
};

eds.getEntry(0x6060).on('update', (mode) => set(0x6061, mode.value));
device.sync.on('sync', () => {
  const word = device.getValue(0x6040);
  const reset = (word & ~last & 0x80) !== 0;
  last = word;
  if (state === 'fault' && reset) enter('disabled');
  const rule = states[state].next.find(([mask, bits]) => (word & mask) === bits);
  if (rule) enter(rule[2]);
  else if (state === 'quick stop') enter('disabled'); // at rest at once
  const position = device.getValue(0x6064);
  const next = state === 'enabled' ? device.getValue(0x607a) : position;
  set(0x606c, (next - position) * 200);
  set(0x6064, next);
});
device.nmt.on('timeout', () => {
  process.stderr.write('master lost\n');
  device.emcy.write(0x8130, Buffer.alloc(5));
  if (state === 'enabled') enter('quick stop');
});
const send = ({ id: cob, data }) => {
  if (!mute) process.stdout.write(`${cob.toString(16).padStart(3, '0')}#${data.toString('hex')}\n`);
};
const bootUp = () => send({ id: 0x700 + id, data: Buffer.from([0]) });
device.on('message', send);
device.nmt.on('reset', () => {
  last = 0;
  if (state !== 'disabled') enter('disabled');
  setImmediate(bootUp);
});
device.start();
bootUp();

const trouble = {
  fault: () => { enter('fault'); device.emcy.write(0x2310, Buffer.alloc(5)); },
  mute: () => { mute = true; },
  hear: () => { mute = false; },
};
require('readline').createInterface({ input: process.stdin }).on('line', (line) => {
  if (trouble[line]) return trouble[line]();
  if (mute) return undefined;
  const [cob, hex] = line.split('#');
  return device.receive({ id: parseInt(cob, 16), data: Buffer.from(hex, 'hex'), len: hex.length / 2 });
}).on('close', () => process.exit(0));
