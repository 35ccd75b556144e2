// The 3-D scene: foxglove.SceneUpdate and FrameTransforms of all topics, z up.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Connection } from "./connection";
import { Motions } from "./motions";
import { RATIOS, Resolution } from "./resolution";

const ROOT = "world";
const FOREVER = 1n << 63n;
const nsOf = (t: any): bigint => (t ? BigInt(t.seconds) * 1_000_000_000n + BigInt(t.nanos) : 0n); // of a time, or a duration
const RESTS_MS = 250; // nothing moves for so long: drawn once more, at the finest
type Rgba = { r: number; g: number; b: number; a: number } | undefined;

const ball = new THREE.SphereGeometry(0.5, 20, 12);
const box = new THREE.BoxGeometry(1, 1, 1);
const rod = new THREE.CylinderGeometry(0.5, 0.5, 1, 20).rotateX(Math.PI / 2); // along z
const cone = new THREE.ConeGeometry(0.5, 1, 24).rotateZ(-Math.PI / 2); // along x
const shared = new Set<THREE.BufferGeometry>([ball, box, rod, cone]);

function surface(color: Rgba): THREE.Material {
  const { r, g, b, a } = color ?? { r: 0.7, g: 0.7, b: 0.7, a: 1 };
  return new THREE.MeshLambertMaterial({
    color: new THREE.Color().setRGB(r, g, b, THREE.SRGBColorSpace),
    transparent: a < 1, opacity: a, depthWrite: a >= 0.99,
  });
}

function place(object: THREE.Object3D, pose: any): THREE.Object3D {
  const p = pose?.position, q = pose?.orientation;
  if (p) object.position.set(p.x, p.y, p.z);
  if (q && (q.x || q.y || q.z || q.w)) object.quaternion.set(q.x, q.y, q.z, q.w);
  return object;
}

function mesh(geometry: THREE.BufferGeometry, color: Rgba, pose: any, size: { x: number; y: number; z: number }) {
  const made = place(new THREE.Mesh(geometry, surface(color)), pose);
  made.scale.set(size.x || 1e-6, size.y || 1e-6, size.z || 1e-6);
  return made;
}

function attribute(points: any[], indices: number[]): THREE.BufferAttribute {
  const n = indices.length || points.length, xyz = new Float32Array(3 * n);
  for (let i = 0; i < n; ++i) {
    const p = points[indices.length ? indices[i]! : i];
    if (p) xyz.set([p.x, p.y, p.z], 3 * i);
  }
  return new THREE.BufferAttribute(xyz, 3);
}

function colours(colors: any[], indices: number[], n: number): THREE.BufferAttribute {
  const rgb = new Float32Array(3 * n), c = new THREE.Color();
  for (let i = 0; i < n; ++i) {
    const from = colors[indices.length ? indices[i]! : i] ?? { r: 1, g: 1, b: 1 };
    c.setRGB(from.r, from.g, from.b, THREE.SRGBColorSpace).toArray(rgb, 3 * i);
  }
  return new THREE.BufferAttribute(rgb, 3);
}

/** Lines and triangles share how points, indices and colours are given. */
function shape(primitive: any): [THREE.BufferGeometry, boolean] {
  const geometry = new THREE.BufferGeometry();
  const points = attribute(primitive.points, primitive.indices);
  geometry.setAttribute("position", points);
  const coloured = primitive.colors.length > 0;
  if (coloured) geometry.setAttribute("color", colours(primitive.colors, primitive.indices, points.count));
  return [geometry, coloured];
}

function line(primitive: any): THREE.Object3D {
  const [geometry, coloured] = shape(primitive);
  const { r, g, b } = primitive.color ?? { r: 1, g: 1, b: 1 };
  const material = new THREE.LineBasicMaterial({
    vertexColors: coloured, color: coloured ? 0xffffff : new THREE.Color().setRGB(r, g, b, THREE.SRGBColorSpace),
  });
  const kinds = [THREE.Line, THREE.LineLoop, THREE.LineSegments] as const;
  return place(new (kinds[primitive.type] ?? THREE.Line)(geometry, material), primitive.pose);
}

function triangles(primitive: any): THREE.Object3D {
  const [geometry, coloured] = shape(primitive);
  geometry.computeVertexNormals();
  const material = surface(coloured ? { r: 1, g: 1, b: 1, a: 1 } : primitive.color) as THREE.MeshLambertMaterial;
  material.vertexColors = coloured;
  material.side = THREE.DoubleSide;
  return place(new THREE.Mesh(geometry, material), primitive.pose);
}

function text(primitive: any): THREE.Object3D {
  const canvas = document.createElement("canvas"), font = "48px sans-serif";
  const pen = canvas.getContext("2d")!;
  pen.font = font;
  canvas.width = Math.ceil(pen.measureText(primitive.text).width) + 16;
  canvas.height = 64;
  pen.font = font;
  const { r, g, b } = primitive.color ?? { r: 1, g: 1, b: 1 };
  pen.fillStyle = `rgb(${255 * r} ${255 * g} ${255 * b})`;
  pen.textBaseline = "middle";
  pen.lineWidth = 6;
  pen.strokeStyle = "#0009"; // readable on light and dark
  pen.strokeText(primitive.text, 8, 32);
  pen.fillText(primitive.text, 8, 32);
  const map = new THREE.CanvasTexture(canvas);
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map, depthTest: false }));
  const height = primitive.scaleInvariant ? 0.1 : primitive.fontSize || 0.1;
  sprite.scale.set((height * canvas.width) / canvas.height, height, 1);
  return place(sprite, primitive.pose);
}

function arrow(primitive: any): THREE.Object3D {
  const whole = place(new THREE.Group(), primitive.pose);
  const shaft = new THREE.Mesh(rod, surface(primitive.color));
  shaft.rotation.y = Math.PI / 2;
  shaft.position.x = primitive.shaftLength / 2;
  shaft.scale.set(primitive.shaftDiameter, primitive.shaftDiameter, primitive.shaftLength || 1e-6);
  const head = new THREE.Mesh(cone, surface(primitive.color));
  head.position.x = primitive.shaftLength + primitive.headLength / 2;
  head.scale.set(primitive.headLength || 1e-6, primitive.headDiameter, primitive.headDiameter);
  return whole.add(shaft, head);
}

/** Many of one form are one thing to draw, if all are opaque. */
function meshes(geometry: THREE.BufferGeometry, all: any[]): THREE.Object3D[] {
  if (all.length < 8 || all.some((p) => (p.color?.a ?? 1) < 1)) return all.map((p) => mesh(geometry, p.color, p.pose, p.size));
  const many = new THREE.InstancedMesh(geometry, surface({ r: 1, g: 1, b: 1, a: 1 }), all.length);
  const one = new THREE.Object3D(), colour = new THREE.Color();
  all.forEach((p, i) => {
    one.quaternion.identity();
    place(one, p.pose).scale.set(p.size.x || 1e-6, p.size.y || 1e-6, p.size.z || 1e-6);
    one.updateMatrix();
    many.setMatrixAt(i, one.matrix);
    const { r, g, b } = p.color ?? { r: 0.7, g: 0.7, b: 0.7 };
    many.setColorAt(i, colour.setRGB(r, g, b, THREE.SRGBColorSpace));
  });
  many.frustumCulled = false; // its bounds are those of one
  return [many];
}

export function build(entity: any): THREE.Group {
  const group = new THREE.Group();
  for (const [geometry, all] of [[box, entity.cubes], [ball, entity.spheres], [rod, entity.cylinders]] as const)
    if (all.length) group.add(...meshes(geometry, all));
  for (const p of entity.arrows) group.add(arrow(p));
  for (const p of entity.lines) group.add(line(p));
  for (const p of entity.triangles) group.add(triangles(p));
  for (const p of entity.texts) group.add(text(p));
  return group;
}

function dispose(object: THREE.Object3D) {
  object.removeFromParent();
  object.traverse((o: any) => {
    if (o.geometry && !shared.has(o.geometry) && !o.isSprite) o.geometry.dispose();
    if (o.isInstancedMesh) o.dispose();
    o.material?.map?.dispose(); // the material holds a program alone, which would be compiled again for the next message
  });
}

export class Scene {
  readonly topics = new Map<string, () => void>(); // how to end listening
  private hidden = new Set<string>(); // topics
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera(45, 1, 0.02, 500);
  private readonly controls: OrbitControls;
  private readonly watch: ResizeObserver;
  private readonly frames = new Map<string, THREE.Group>();
  private readonly entities = new Map<string, THREE.Group>(); // by topic and id
  private readonly motions = new Motions();
  private readonly resolution = new Resolution();
  private accompanied = "";
  private middle: THREE.Vector3 | undefined; // of what is accompanied, on the ground
  private dirty = true;
  private framed = false; // the camera has been turned to what is there
  private aimed = false; // somebody has said where to look from
  private still = false; // draws on demand alone
  /** Pictures drawn in the last second. */
  rate = 0;

  /** `film`: pictures of one size, with smooth edges; else edges are smooth where more pixels are drawn than shown. */
  constructor(private readonly canvas: HTMLCanvasElement, film = false) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: film, preserveDrawingBuffer: true });
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(2.6, -2.2, 1.7);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.target.set(0.4, 0, 0.4);
    this.controls.addEventListener("change", () => (this.dirty = true));
    const sun = new THREE.DirectionalLight(0xffffff, 1.8);
    sun.position.set(2, -3, 5);
    const grid = new THREE.GridHelper(20, 40, 0x667788, 0x3a4450).rotateX(Math.PI / 2);
    this.scene.add(sun, new THREE.HemisphereLight(0xffffff, 0x445566, 1.4), grid);
    this.scene.add(this.frame(ROOT));
    this.watch = new ResizeObserver(() => this.resize(canvas.clientWidth, canvas.clientHeight));
    this.watch.observe(canvas);
    const dark = matchMedia("(prefers-color-scheme: dark)");
    const colour = () => ((this.scene.background = new THREE.Color(dark.matches ? 0x14181d : 0xe9edf1)), (this.dirty = true));
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
    for (const [key, entity] of this.entities) if (key.startsWith(`${this.accompanied}\n`)) bounds.expandByObject(entity);
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
    for (const [key, group] of this.entities) group.visible = !this.hidden.has(key.split("\n")[0]!);
    this.dirty = true;
  }

  /** Eye and what it looks at [m]. */
  aim(camera: number[]) {
    this.framed = this.aimed = true;
    this.camera.position.fromArray(camera);
    this.controls.target.fromArray(camera, 3);
    this.controls.update();
    this.dirty = true;
  }

  /** Turns the camera to all that is there. */
  look() {
    const bounds = new THREE.Box3();
    for (const entity of this.entities.values()) bounds.expandByObject(entity);
    if (bounds.isEmpty()) return;
    const middle = bounds.getCenter(new THREE.Vector3()), radius = Math.min(20, bounds.getSize(new THREE.Vector3()).length() / 2);
    this.controls.target.copy(middle);
    this.camera.position.copy(middle).addScaledVector(new THREE.Vector3(1, -0.9, 0.6).normalize(), 2.2 * radius + 0.3);
    this.controls.update();
    this.dirty = true;
  }

  /** A size of its own [px], and the camera [m], for pictures; none: all there is. */
  pose(width: number, height: number, camera: number[]) {
    this.framed = true;
    this.still = this.motions.atOnce = true;
    this.watch.disconnect();
    this.renderer.setPixelRatio(1);
    this.resize(width, height);
    camera.length ? this.aim(camera) : this.look();
  }

  picture(type: string): Promise<Blob> {
    this.motions.advance(0);
    this.renderer.render(this.scene, this.camera);
    return new Promise((done) => this.canvas.toBlob((blob) => done(blob!), type, 0.95));
  }

  /** What was not there yet at this time [ns] goes. */
  rewind(ns: bigint) {
    this.remove((_, { stampNs }) => stampNs > ns);
  }

  private remove(which: (key: string, of: { stampNs: bigint; endNs: bigint }) => boolean) {
    for (const [key, group] of this.entities) {
      if (!which(key, group.userData as any)) continue;
      dispose(group);
      this.entities.delete(key);
      this.dirty = true;
    }
  }

  /** `ns`: time of the message. */
  update(topic: string, message: any, ns = 0n) {
    this.remove((key, { endNs }) => endNs < ns && key.startsWith(`${topic}\n`)); // their lifetime is over
    for (const gone of message.deletions)
      this.remove((key) => key === `${topic}\n${gone.id}` || (gone.type === 1 && key.startsWith(`${topic}\n`)));
    for (const entity of message.entities) {
      const key = `${topic}\n${entity.id}`, before = this.entities.get(key);
      if (before) dispose(before);
      const group = build(entity), stampNs = nsOf(entity.timestamp) || ns, lifetimeNs = nsOf(entity.lifetime);
      group.userData = { stampNs, endNs: lifetimeNs ? stampNs + lifetimeNs : FOREVER };
      group.visible = !this.hidden.has(topic);
      this.frame(entity.frameId || ROOT).add(group);
      this.entities.set(key, group);
    }
    this.dirty = true;
    if (topic === this.accompanied) this.goAlong();
    if (!this.framed && this.entities.size > 0) (this.framed = true), setTimeout(() => this.aimed || this.look(), 300);
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
      if (this.dirty) (last = now), ++drawn;
      this.dirty = this.motions.advance(now);
      this.renderer.render(this.scene, this.camera);
    };
    draw();
  }
}
