// The 3-D scene: foxglove.SceneUpdate and FrameTransforms of all topics, z up.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Connection } from "./connection";
import { Entities } from "./entities";
import { ease, filled, fit, type Pose } from "./fit";
import { arrange } from "./labels";
import { Motions } from "./motions";
import { ball } from "./shapes";
import { RATIOS, Resolution } from "./resolution";
import { bySoftware, Surroundings } from "./surroundings";

const ROOT = "world";
const RESTS_MS = 250; // nothing moves for so long: drawn once more, at the finest
const LOOK_MS = 250; // between two looks whether all is in the picture
const SMALL = 400; // corners of a part that is measured by them, and not by its box: a turned one would reach below the ground
const FULL = 1.02, EMPTY = 0.55; // parts of the picture beyond which the camera moves
export class Scene {
  readonly topics = new Map<string, () => void>(); // how to end listening
  private hidden = new Set<string>(); // topics
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera(45, 1, 0.02, 500);
  private readonly controls: OrbitControls;
  private readonly watch: ResizeObserver;
  private readonly frames = new Map<string, THREE.Group>();
  private readonly entities: Entities;
  private readonly motions = new Motions();
  private readonly resolution = new Resolution();
  private readonly surroundings: Surroundings;
  private accompanied = "";
  private middle: THREE.Vector3 | undefined; // of what is accompanied, on the ground
  private dirty = true;
  private fitting = true; // the camera keeps all in the picture, until somebody takes it
  private goal: Pose | undefined; // where it goes
  private looked = -Infinity;
  private readonly size = new THREE.Vector2(1, 1); // [CSS px]
  private still = false; // draws on demand alone
  /** Pictures drawn in the last second. */
  rate = 0;

  /** `film`: pictures of one size, with smooth edges; else edges are smooth where more pixels are drawn than shown. */
  constructor(private readonly canvas: HTMLCanvasElement, film = false) {
    const card = !bySoftware(document.createElement("canvas").getContext("webgl2")!);
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: film || card, preserveDrawingBuffer: true });
    this.surroundings = new Surroundings(this.renderer, film || card);
    this.entities = new Entities(film || card, (group, frame) => this.frame(frame || ROOT).add(group));
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(2.6, -2.2, 1.7);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.target.set(0.4, 0, 0.4);
    this.controls.addEventListener("change", () => (this.dirty = true));
    this.controls.addEventListener("start", () => ((this.fitting = false), (this.goal = undefined)));
    this.scene.add(this.surroundings.group);
    this.scene.add(this.frame(ROOT));
    this.watch = new ResizeObserver(() => this.resize(canvas.clientWidth, canvas.clientHeight));
    this.watch.observe(canvas);
    const dark = matchMedia("(prefers-color-scheme: dark)");
    const colour = () => (this.surroundings.colour(dark.matches), (this.dirty = true));
    dark.addEventListener("change", colour);
    colour();
    this.loop();
  }

  /** Shows what the topics of the graph draw, as they come and go. */
  follow(connection: Connection) {
    for (const [topic, channel] of connection.channels.value) {
      if (this.topics.has(topic)) continue;
      if (channel.schemaName === "foxglove.SceneUpdate")
        this.topics.set(topic, connection.listen(topic, (m, ns) => this.update(topic, m, ns)));
      if (channel.schemaName === "foxglove.FrameTransforms")
        this.topics.set(topic, connection.listen(topic, (m) => this.move(m.transforms)));
    }
  }

  /** The camera goes along, over the ground, with what this topic draws; empty: stands. */
  accompany(topic: string) {
    this.accompanied = topic;
    this.middle = undefined;
  }

  private goAlong() {
    const bounds = new THREE.Box3();
    for (const entity of this.entities.of(this.accompanied)) bounds.expandByObject(entity);
    if (bounds.isEmpty()) return;
    const middle = bounds.getCenter(new THREE.Vector3()).setZ(0);
    const way = middle.clone().sub(this.middle ?? this.controls.target).setZ(0);
    this.middle = middle;
    this.camera.position.add(way);
    this.controls.target.add(way);
    this.controls.update();
  }

  /** Shows all topics but these. */
  hide(topics: string[]) {
    this.hidden = new Set(topics);
    this.entities.hide(this.hidden);
    this.dirty = true;
  }

  /** Eye and what it looks at [m]: the direction from which all is shown. */
  aim(camera: number[]) {
    this.camera.position.fromArray(camera);
    this.controls.target.fromArray(camera, 3);
    this.controls.update();
    this.fitting = true;
    this.looked = -Infinity;
    this.dirty = true;
  }

  /** Keeps all there is in the picture from now on. */
  look() {
    this.fitting = true;
    this.goal = fit(this.camera, this.controls.target, this.bounds());
    this.dirty = true;
  }

  /** What is shown, without texts; `standing`: boxes, rods and meshes alone, as balls mark points on the ground. */
  private bounds(standing = false): THREE.Box3 {
    const bounds = new THREE.Box3();
    this.scene.updateMatrixWorld();
    for (const entity of this.entities.shown()) {
      for (const part of entity.children as any[]) {
        if (part.isSprite || (standing && (!part.isMesh || part.geometry === ball))) continue;
        bounds.expandByObject(part, !part.isInstancedMesh && part.geometry?.attributes.position.count < SMALL);
      }
    }
    return bounds;
  }

  /** The part of the picture that all there is fills, along its longer side; above 1: some is cut off. */
  filled(): number {
    return filled(this.camera, this.bounds());
  }

  /** Looks from time to time whether all is in the picture, and goes where it is. */
  private keepInPicture(now: number, s: number) {
    if (now - this.looked > LOOK_MS && this.dirty) {
      const first = this.looked === -Infinity, bounds = this.bounds();
      if (bounds.isEmpty()) return;
      this.looked = now;
      this.surroundings.around(bounds, this.bounds(true).min.z);
      const part = this.fitting ? filled(this.camera, bounds) : 1;
      if (part > FULL || part < EMPTY) this.goal = fit(this.camera, this.controls.target, bounds);
      if (first && this.goal) (this.camera.position.copy(this.goal.eye), this.controls.target.copy(this.goal.target), (this.goal = undefined)), this.controls.update();
    }
    if (!this.goal) return;
    if (!ease(this.camera.position, this.controls.target, this.goal, s)) this.goal = undefined;
    this.controls.update();
    this.dirty = true;
  }

  /** A size of its own [px], and the camera [m], for pictures; none: all there is. */
  pose(width: number, height: number, camera: number[]) {
    this.still = this.motions.atOnce = true;
    this.watch.disconnect();
    this.renderer.setPixelRatio(1);
    this.resize(width, height);
    const bounds = this.bounds();
    if (camera.length) this.aim(camera);
    else if (!bounds.isEmpty()) {
      const { eye, target } = fit(this.camera, this.controls.target, bounds);
      this.aim([...eye.toArray(), ...target.toArray()]);
    }
    this.fitting = false;
  }

  picture(type: string): Promise<Blob> {
    this.motions.advance(0);
    const bounds = this.bounds();
    if (!bounds.isEmpty()) this.surroundings.around(bounds, this.bounds(true).min.z);
    this.draw(true);
    return new Promise((done) => this.canvas.toBlob((blob) => done(blob!), type, 0.95));
  }

  /** What was not there yet at this time [ns] goes. */
  rewind(ns: bigint) {
    this.entities.rewind(ns);
    this.dirty = true;
  }

  /** `ns`: time of the message. */
  update(topic: string, message: any, ns = 0n) {
    this.entities.update(topic, message, ns, !this.hidden.has(topic));
    this.dirty = true;
    if (topic === this.accompanied) this.goAlong();
  }

  move(transforms: any[], now = performance.now()) {
    for (const t of transforms) {
      const child = this.frame(t.childFrameId), parent = this.frame(t.parentFrameId || ROOT);
      if (child.parent !== parent && !this.below(parent, child)) parent.add(child);
      const p = t.translation, q = t.rotation;
      this.motions.send(child, new THREE.Vector3(p?.x ?? 0, p?.y ?? 0, p?.z ?? 0), q && new THREE.Quaternion(q.x, q.y, q.z, q.w), now);
    }
    this.dirty = true;
  }

  /** A frame that is its own parent would never end. */
  private below(node: THREE.Object3D | null, above: THREE.Object3D): boolean {
    for (; node; node = node.parent) if (node === above) return true;
    return false;
  }

  private frame(name: string): THREE.Group {
    let group = this.frames.get(name);
    if (group) return group;
    group = new THREE.Group();
    this.frames.set(name, group);
    if (name !== ROOT) this.frame(ROOT).add(group); // until its parent is known
    return group;
  }

  private resize(w: number, h: number) {
    if (w === 0 || h === 0) return;
    this.size.set(w, h);
    this.renderer.setSize(w, h, false);
    this.camera.aspect = w / h;
    this.camera.updateProjectionMatrix();
    this.dirty = true;
  }

  private loop() {
    let drawn = 0, since = performance.now(), last = since, moving = false;
    const draw = () => {
      requestAnimationFrame(draw);
      const now = performance.now();
      if (now - since > 1000) (this.rate = (1000 * drawn) / (now - since)), (drawn = 0), (since = now);
      if (this.still) return;
      if (moving && this.dirty) this.resolution.drawn(now - last, now); // two pictures in a row
      const rests = !this.dirty && now - last > RESTS_MS;
      moving = this.dirty;
      const ratio = rests ? RATIOS[0]! : this.resolution.ratio;
      if (!this.dirty && (!rests || ratio === this.renderer.getPixelRatio())) return;
      if (ratio !== this.renderer.getPixelRatio()) this.renderer.setPixelRatio(ratio);
      const before = last;
      if (this.dirty) (last = now), ++drawn;
      const dirty = this.motions.advance(now);
      this.keepInPicture(now, Math.min(0.1, (now - before) / 1000));
      this.dirty = dirty || !!this.goal;
      this.draw(rests);
    };
    draw();
  }

  /** `last`: nothing moves any more. */
  private draw(last: boolean) {
    this.scene.updateMatrixWorld();
    this.camera.updateMatrixWorld();
    this.surroundings.draw(this.camera, last);
    const { x, y } = this.size;
    arrange(this.texts(), this.camera, x, y);
    this.renderer.render(this.scene, this.camera);
  }

  private *texts(): Generator<THREE.Sprite> {
    for (const entity of this.entities.shown()) for (const part of entity.children) if ((part as any).isSprite) yield part as THREE.Sprite;
  }
}
