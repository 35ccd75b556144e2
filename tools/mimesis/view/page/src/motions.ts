// Frames between two messages. Messages are rarer than pictures: a frame goes evenly from where it is drawn to where the last message
// has it, in the time that lies between two messages.
import { Quaternion, Vector3, type Object3D } from "three";

type Motion = {
  from: { at: Vector3; turn: Quaternion };
  to: { at: Vector3; turn: Quaternion };
  begun: number; // [ms]
  every: number; // time between two messages, smoothed [ms]; 0: at once
};
/** Rarer messages are shown as they come [ms]. */
const SLOWEST = 150;

export class Motions {
  private readonly all = new Map<Object3D, Motion>();
  /** Frames are at once where they are told to be. */
  atOnce = false;

  /** The last message has `frame` at this place, with this turn (none: as it is). */
  send(frame: Object3D, at: Vector3, turn: Quaternion | undefined, now: number) {
    const before = this.all.get(frame), gap = before ? now - before.begun : Infinity;
    this.all.set(frame, {
      from: { at: frame.position.clone(), turn: frame.quaternion.clone() },
      to: { at, turn: turn ?? frame.quaternion.clone() },
      begun: now,
      every: gap > SLOWEST ? 0 : before!.every ? 0.8 * before!.every + 0.2 * gap : gap,
    });
  }

  /** Places all frames as they are at this time [ms]; whether some still move. */
  advance(now: number): boolean {
    let moving = false;
    for (const [frame, { from, to, begun, every }] of this.all) {
      const share = every > 0 && !this.atOnce ? Math.min(1, (now - begun) / every) : 1;
      frame.position.lerpVectors(from.at, to.at, share);
      frame.quaternion.slerpQuaternions(from.turn, to.turn, share);
      moving ||= share < 1;
    }
    return moving;
  }
}
