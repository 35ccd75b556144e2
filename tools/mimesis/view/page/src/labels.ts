// Texts in the scene: readable from where the camera is, none over another.
import { Sprite, Vector3, type PerspectiveCamera } from "three";
import { free } from "./image";

const LEAST = 11, MOST = 26; // height of a text [CSS px]
const at = new Vector3();

/** Places the texts for a picture of this size [CSS px]: the nearest ones first; others give way, or are left out where it is full. */
export function arrange(texts: Iterable<Sprite>, camera: PerspectiveCamera, width: number, height: number) {
  const perMetre = height / (2 * Math.tan((camera.fov * Math.PI) / 360)); // [px] at a distance of 1 m
  const seen: { text: Sprite; deep: number; x: number; y: number }[] = [];
  for (const text of texts) {
    at.setFromMatrixPosition(text.matrixWorld).applyMatrix4(camera.matrixWorldInverse);
    const deep = -at.z;
    text.visible = deep > camera.near;
    if (!text.visible) continue;
    at.applyMatrix4(camera.projectionMatrix);
    seen.push({ text, deep, x: ((at.x + 1) / 2) * width, y: ((1 - at.y) / 2) * height });
  }
  const taken: Parameters<typeof free>[0] = [];
  for (const { text, deep, x, y } of seen.sort((a, b) => a.deep - b.deep)) {
    const { metres, aspect } = text.userData as { metres: number; aspect: number };
    const tall = Math.min(MOST, Math.max(LEAST, (metres * perMetre) / deep)), wide = tall * aspect;
    const box = { x: x - wide / 2, y: y - tall / 2, w: wide, h: tall };
    const moved = free(taken, box) - box.y;
    text.visible = Math.abs(moved) < 4 * tall;
    if (!text.visible) taken.pop();
    text.scale.set((wide * deep) / perMetre, (tall * deep) / perMetre, 1);
    text.center.set(0.5, 0.5 + moved / tall);
  }
}
