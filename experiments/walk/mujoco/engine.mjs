// node engine.mjs PATH_OF_MUJOCO_JS: MuJoCo as a program on one socket, standard input and output. All numbers are doubles.
//   in   bytes of a model's XML, the XML              out  numbers in a row of measures, first row
//   in   steps, for each: ctrl (nu), data 0 of every  out  a row for each step,
//        equality (neq), force on every body's centre       one for the state after
//        of mass but the world's, in W (3 (nbody - 1))
// Row: sensordata, torque of every equality: each is of one joint, and the model's numeric data are the most that it may
// be. Positions and velocities are those before the step, forces and torques those that act in it. Behind a tick's steps comes a row with what they led to;
// forces in it mean nothing. The state starts as the first keyframe has it.
import { readSync, writeSync } from "node:fs";

const { default: load } = await import(process.argv[2]);
const mujoco = await load({ print: console.error, printErr: console.error });

function read(bytes) {
  const buffer = Buffer.alloc(bytes);
  for (let at = 0; at < bytes; ) {
    const n = readSync(0, buffer, at, bytes - at, null);
    if (n === 0) process.exit(0); // who asked is gone
    at += n;
  }
  return buffer;
}
function readNumbers(count) {
  const buffer = read(8 * count);
  return new Float64Array(buffer.buffer, buffer.byteOffset, count);
}
function write(numbers) {
  const bytes = Buffer.from(numbers.buffer, numbers.byteOffset, numbers.byteLength);
  for (let at = 0; at < bytes.length; ) at += writeSync(1, bytes, at);
}

const model = mujoco.MjModel.from_xml_string(read(readNumbers(1)[0]).toString());
const data = new mujoco.MjData(model);
mujoco.mj_resetDataKeyframe(model, data, 0);
mujoco.mj_step1(model, data);

const { nu, neq, nbody, nsensordata } = model;
const width = nsensordata + neq;
write(Float64Array.of(width, ...data.sensordata, ...new Array(neq).fill(0)));

const asked = nu + neq + 3 * (nbody - 1);
const most = Float64Array.from(model.numeric_data); // torque of every equality's joint
const torque = new Float64Array(neq);

// How hard a constraint holds, and one that lets go: MuJoCo's least is 1e-4 of its force.
const held = Float64Array.from(model.eq_solimp), limp = Float64Array.from(held, (x, k) => (k % 5 < 2 ? 1e-4 : x));

// Forces and accelerations. Equalities know no limit: one that needs more than its joint has becomes that torque.
function solve() {
  const limited = new Set();
  mujoco.mj_step1(model, data);
  for (let before = -1; before < limited.size; ) {
    if (before >= 0) mujoco.mj_step1(model, data); // constraints without them
    before = limited.size;
    mujoco.mj_fwdActuation(model, data);
    mujoco.mj_fwdAcceleration(model, data);
    mujoco.mj_fwdConstraint(model, data);
    for (let i = 0; i < neq; ++i) {
      if (limited.has(i)) continue;
      torque[i] = data.efc_force[i];
      if (Math.abs(torque[i]) <= most[i]) continue;
      torque[i] = Math.sign(torque[i]) * most[i];
      data.qfrc_applied[model.jnt_dofadr[model.eq_obj1id[i]]] = torque[i];
      model.eq_solimp.set(limp.subarray(5 * i, 5 * i + 5), 5 * i);
      limited.add(i);
    }
  }
}

for (;;) {
  const steps = readNumbers(1)[0];
  const wishes = readNumbers(steps * asked);
  const rows = new Float64Array((steps + 1) * width);
  for (let s = 0; s < steps; ++s) {
    const wish = wishes.subarray(s * asked, (s + 1) * asked);
    data.ctrl.set(wish.subarray(0, nu));
    const eqData = model.eq_data, stride = eqData.length / Math.max(neq, 1);
    for (let i = 0; i < neq; ++i) eqData[i * stride] = wish[nu + i];
    const force = data.xfrc_applied;
    for (let b = 1; b < nbody; ++b) {
      for (let k = 0; k < 3; ++k) force[6 * b + k] = wish[nu + neq + 3 * (b - 1) + k];
    }
    model.eq_solimp.set(held);
    data.qfrc_applied.fill(0);
    solve(); // from here as mj_step2
    mujoco.mj_sensorAcc(model, data);
    mujoco.mj_implicit(model, data);
    rows.set(data.sensordata, s * width);
    rows.set(torque, s * width + nsensordata);
  }
  mujoco.mj_step1(model, data);
  rows.set(data.sensordata, steps * width);
  write(rows);
}
