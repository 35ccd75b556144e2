// Light, shadows, ground and sky around what is drawn. Without a graphics card each pixel and each triangle counts: ground and sky are
// three colours behind all, shadows fall on the ground and on boxes, and come when things rest.
import * as THREE from "three";

const SHADOW_PIXELS = 2048;

/** No graphics card draws, but the processor. */
export function bySoftware(gl: WebGLRenderingContext | WebGL2RenderingContext): boolean {
  const names = gl.getExtension("WEBGL_debug_renderer_info");
  return /swiftshader|llvmpipe|software/i.test(String(gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER)));
}
const LINES = 20, PIECE = 10; // on each side of the middle; of a line

/** Lines on the ground that fade with the distance. */
function lines(): THREE.LineSegments<THREE.BufferGeometry, THREE.ShaderMaterial> {
  const ends: number[] = [];
  for (let i = -LINES; i <= LINES; ++i)
    for (let k = -LINES; k < LINES; k += PIECE) ends.push(i, k, 0, i, k + PIECE, 0, k, i, 0, k + PIECE, i, 0); // they fade from end to end
  const geometry = new THREE.BufferGeometry().setAttribute("position", new THREE.Float32BufferAttribute(ends, 3));
  const drawn = new THREE.LineSegments(geometry, new THREE.ShaderMaterial({
    transparent: true, depthWrite: false, uniforms: { color: { value: new THREE.Color() } },
    vertexShader: `varying float shown; void main() {
      shown = 1.0 - smoothstep(0.2, 1.0, length(position) / ${LINES.toFixed(1)});
      gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`,
    fragmentShader: "uniform vec3 color; varying float shown; void main() { gl_FragColor = vec4(color, 0.55 * shown);\n#include <colorspace_fragment>\n}",
  }));
  drawn.renderOrder = -1;
  drawn.frustumCulled = false;
  return drawn;
}

const DARK = { sky: 0x12161b, horizon: 0x2c353f, ground: 0x3b444e, lines: 0x20262d };
const LIGHT = { sky: 0xbcd0e4, horizon: 0xf1f4f7, ground: 0xd6dbe0, lines: 0x9aa5b0 };

/** Sky and ground behind all: colours between three heights of the picture, the cheapest there is. */
class Backdrop extends THREE.Mesh<THREE.BufferGeometry, THREE.ShaderMaterial> {
  constructor() {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(24, 3)); // y of sky, horizon, horizon, ground, left and right
    geometry.setAttribute("color", new THREE.Float32BufferAttribute(24, 3));
    geometry.setIndex([0, 2, 1, 1, 2, 3, 2, 4, 3, 3, 4, 5, 4, 6, 5, 5, 6, 7]);
    super(geometry, new THREE.ShaderMaterial({
      vertexColors: true, depthTest: false, depthWrite: false,
      vertexShader: "varying vec3 shown; void main() { shown = color; gl_Position = vec4(position, 1.0); }",
      fragmentShader: "varying vec3 shown; void main() { gl_FragColor = vec4(shown, 1.0); }",
    }));
    this.frustumCulled = false;
    this.renderOrder = -2;
  }

  colour({ sky, horizon, ground }: typeof DARK) {
    const colours = this.geometry.getAttribute("color");
    [sky, horizon, ground, ground].forEach((c, row) => {
      for (const i of [2 * row, 2 * row + 1]) colours.setXYZ(i, ((c >> 16) & 255) / 255, ((c >> 8) & 255) / 255, (c & 255) / 255);
    });
    colours.needsUpdate = true;
  }

  follow(camera: THREE.PerspectiveCamera) {
    const z = camera.getWorldDirection(new THREE.Vector3()).z, places = this.geometry.getAttribute("position");
    const horizon = -z / Math.sqrt(Math.max(1e-9, 1 - z * z)) / Math.tan((camera.fov * Math.PI) / 360);
    [Math.max(1.01, horizon + 1.2), horizon, horizon - 1.4, Math.min(-1.01, horizon - 1.41)].forEach((y, row) => {
      places.setXYZ(2 * row, -1, y, 0), places.setXYZ(2 * row + 1, 1, y, 0);
    });
    places.needsUpdate = true;
  }
}

export class Surroundings {
  readonly group = new THREE.Group();
  private readonly sun = new THREE.DirectionalLight(0xfff4e6, 2.2);
  private readonly light = new THREE.HemisphereLight(0xffffff, 0x8a8f99, 1.5);
  private readonly lines = lines();
  private readonly shadows = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), new THREE.ShadowMaterial({ opacity: 0.35, depthWrite: false }));
  private readonly backdrop = new Backdrop();

  /** `fine`: shadows are soft, and of each picture. */
  constructor(private readonly renderer: THREE.WebGLRenderer, private readonly fine: boolean) {
    renderer.shadowMap.enabled = true;
    renderer.shadowMap.autoUpdate = false;
    renderer.shadowMap.type = fine ? THREE.PCFShadowMap : THREE.BasicShadowMap;
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.setScalar(SHADOW_PIXELS);
    this.sun.shadow.bias = -1e-3;
    this.sun.shadow.normalBias = 0.02;
    this.sun.shadow.radius = 2;
    this.shadows.receiveShadow = true;
    this.shadows.renderOrder = -1;
    this.group.add(this.sun, this.sun.target, this.light, this.backdrop, this.lines, this.shadows);
  }

  colour(dark: boolean) {
    const colours = dark ? DARK : LIGHT;
    this.backdrop.colour(colours);
    this.lines.material.uniforms.color!.value.set(colours.lines);
  }

  /** The sun's shadows fall on what is in the box and on the ground, which lies below `lowest` [m]. */
  around(box: THREE.Box3, lowest: number) {
    const UNDER = 2e-3; // so that what lies on the ground is not in it [m]
    const low = Math.min(0, lowest) - UNDER, middle = box.getCenter(new THREE.Vector3());
    const size = box.getSize(new THREE.Vector3()), radius = Math.max(0.5, size.length() / 2);
    const cell = radius > 20 ? 5 : radius > 4 ? 1 : 0.5; // [m]
    this.lines.position.set(cell * Math.round(middle.x / cell), cell * Math.round(middle.y / cell), low);
    this.lines.scale.set(cell, cell, 1);
    this.shadows.position.set(middle.x, middle.y, low + UNDER / 2);
    this.shadows.scale.set(size.x / 2 + size.z, size.y / 2 + size.z, 1);
    this.sun.target.position.copy(middle);
    this.sun.position.copy(middle).add(new THREE.Vector3(0.45, -0.6, 1).normalize().multiplyScalar(2 * radius));
    const { camera } = this.sun.shadow;
    camera.left = camera.bottom = -radius;
    camera.right = camera.top = radius;
    camera.near = 0.1 * radius;
    camera.far = 4 * radius;
    camera.updateProjectionMatrix();
  }

  /** Before a picture; `last`: of things that rest now. */
  draw(camera: THREE.PerspectiveCamera, last: boolean) {
    this.backdrop.follow(camera);
    const shown = this.fine || last;
    this.shadows.visible = this.renderer.shadowMap.needsUpdate = shown;
    this.sun.castShadow = shown; // without, no pixel asks for them
  }
}
