// How finely moving things are drawn: as finely as the machine can at the rate of the display. Without a graphics card this is coarser;
// what stands still is drawn at the finest.

/** Pixels of the picture per CSS pixel, finest first; 2 smooths edges on plain displays. */
export const RATIOS = [2, 1.4, 1, 0.7, 0.5];
const SLOW = 18, FAST = 17.5; // mean time of a picture [ms]
const PICTURES = 6, // that are averaged
  STEADY = 120, // fast ones in a row before finer is tried
  FIRST = 3000,
  WARNED = 30_000; // so long nothing is tried that was too slow [ms]

export class Resolution {
  private level = RATIOS.indexOf(1);
  private sum = 0;
  private count = 0;
  private steady = 0;
  private slow = 0; // mean time before the last step to coarser, until it has helped [ms]
  private held = -Infinity; // until then the pixels are not what takes the time [ms]
  private patience = FIRST; // longer each time that fewer pixels have not helped [ms]
  private readonly failed = RATIOS.map(() => -Infinity); // when a level was too slow [ms]

  get ratio(): number {
    return RATIOS[this.level]!;
  }

  /** A picture of moving things took `took` until the next could be drawn; `now` [ms]. Whether the ratio is another now. */
  drawn(took: number, now: number): boolean {
    this.sum += took;
    if (++this.count < PICTURES) return false;
    const mean = this.sum / this.count;
    this.sum = this.count = 0;
    if (this.slow > 0 && mean > 0.95 * this.slow) {
      this.slow = 0;
      this.held = now + this.patience;
      this.patience = Math.min(2 * this.patience, WARNED);
      --this.level;
      return true;
    }
    this.slow = 0;
    this.steady = mean < FAST ? this.steady + PICTURES : 0;
    if (mean > SLOW && this.level + 1 < RATIOS.length && now > this.held) {
      this.slow = mean;
      this.failed[this.level++] = now;
      return true;
    }
    if (this.steady < STEADY || this.level === 0 || now - this.failed[this.level - 1]! < WARNED) return false;
    this.steady = 0;
    --this.level;
    return true;
  }
}
