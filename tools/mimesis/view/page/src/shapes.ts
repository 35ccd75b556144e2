// The primitives of a foxglove.SceneEntity as three draws them, z up.
import * as THREE from "three";

type Rgba = { r: number; g: number; b: number; a: number } | undefined;

export const ball = new THREE.SphereGeometry(0.504, 20, 12); // a little larger: where it meets a rod of its width the seam is a line
const box = new THREE.BoxGeometry(1, 1, 1);
const rod = new THREE.CylinderGeometry(0.5, 0.5, 1, 20).rotateX(Math.PI / 2); // along z
const cone = new THREE.ConeGeometry(0.5, 1, 24).rotateZ(-Math.PI / 2); // along x
const shared = new Set<THREE.BufferGeometry>([ball, box, rod, cone]);

const tapered = new Map<string, THREE.BufferGeometry>();

/** A cylinder along z whose ends are these shares of its width; none given: a rod. */
export function cylinder(bottom: number, top: number): THREE.BufferGeometry {
  if ((bottom === 1 && top === 1) || (!bottom && !top)) return rod;
  const key = `${bottom.toFixed(2)} ${top.toFixed(2)}`;
  let geometry = tapered.get(key);
  if (!geometry) {
    geometry = new THREE.CylinderGeometry(0.5 * top, 0.5 * bottom, 1, 20).rotateX(Math.PI / 2);
    tapered.set(key, geometry);
    shared.add(geometry);
  }
  return geometry;
}

/** Cylinders by their shape. */
function byShape(all: any[]): [THREE.BufferGeometry, any[]][] {
  const found = new Map<THREE.BufferGeometry, any[]>();
  for (const c of all) {
    const geometry = cylinder(c.bottomScale ?? 1, c.topScale ?? 1);
    found.set(geometry, [...(found.get(geometry) ?? []), c]);
  }
  return [...found];
}

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
  sprite.userData = { metres: height, aspect: canvas.width / canvas.height };
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

const between = (a: any, b: any) => new THREE.Vector3(b.x - a.x, b.y - a.y, b.z - a.z);
const same = (a: any, b: any) =>
  a.size.x === b.size.x && ["r", "g", "b", "a"].every((c) => a.color?.[c] === b.color?.[c]) && a.size.x === a.size.y && a.size.x === a.size.z;
const FEWEST = 4, STRAIGHT = 1e-6, NEAR = 0.9;

/** Rows of equal balls that stand for a rod, so near that they meet, and the rest. */
export function rows(balls: any[]): { rods: { from: any; to: any }[]; rest: any[] } {
  const rods: { from: any; to: any }[] = [], rest: any[] = [];
  for (let i = 0; i < balls.length; ) {
    let end = i + 1, way: THREE.Vector3 | undefined;
    for (; end < balls.length && same(balls[i], balls[end]); ++end) {
      const step = between(balls[end - 1].pose.position, balls[end].pose.position), length = step.length();
      if (length === 0 || length > NEAR * balls[i].size.x || (way && step.normalize().dot(way) < 1 - STRAIGHT)) break;
      way ??= step.normalize();
    }
    if (end - i >= FEWEST) rods.push({ from: balls[i], to: balls[end - 1] });
    else rest.push(...balls.slice(i, (end = i + 1)));
    i = end;
  }
  return { rods, rest };
}

/** A rod with round ends, from the first ball of a row to the last. */
function capsule({ from, to }: { from: any; to: any }): THREE.Object3D {
  const way = between(from.pose.position, to.pose.position), radius = from.size.x / 2;
  const made = new THREE.Mesh(new THREE.CapsuleGeometry(radius, way.length(), 5, 20).rotateX(Math.PI / 2), surface(from.color));
  const { x, y, z } = from.pose.position;
  made.position.set(x, y, z).addScaledVector(way, 0.5);
  made.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), way.normalize());
  return made;
}

/** `shaded`: shadows fall on all parts, else on boxes alone. */
export function build(entity: any, shaded = true): THREE.Group {
  const group = new THREE.Group(), { rods, rest } = rows(entity.spheres);
  for (const rod of rods) group.add(capsule(rod));
  for (const [geometry, all] of [[box, entity.cubes], [ball, rest], ...byShape(entity.cylinders)] as const)
    if (all.length) group.add(...meshes(geometry, all));
  for (const p of entity.arrows) group.add(arrow(p));
  for (const p of entity.lines) group.add(line(p));
  for (const p of entity.triangles) group.add(triangles(p));
  for (const p of entity.texts) group.add(text(p));
  group.traverse((o: any) => {
    if (!o.isMesh) return;
    o.receiveShadow = shaded || o.geometry === box;
    o.castShadow = !o.material.transparent;
  });
  return group;
}

export function dispose(object: THREE.Object3D) {
  object.removeFromParent();
  object.traverse((o: any) => {
    if (o.geometry && !shared.has(o.geometry) && !o.isSprite) o.geometry.dispose();
    if (o.isInstancedMesh) o.dispose();
    o.material?.map?.dispose(); // the material holds a program alone, which would be compiled again for the next message
  });
}
