// Three scenes that a daemon without any can begin with, made here as files in glTF 2.0: one to see
// contact, one with long shadows of thin things, one of many layers.
import { add, cross, unit } from "../lens.js";

const STONE = [0.62, 0.56, 0.48], CLAY = [0.62, 0.25, 0.14], LEAF = [0.2, 0.42, 0.14],
  IRON = [0.16, 0.17, 0.2], SEA = [0.12, 0.3, 0.5];

class Mesh {
  positions = [];
  normals = [];
  indices = [];

  constructor(color, roughness = 0.7) {
    Object.assign(this, { color, roughness });
  }

  /** A grid of points and normals over two parameters from 0 to 1. */
  sheet(across, along, at) {
    const first = this.positions.length;
    for (let j = 0; j <= along; j++)
      for (let i = 0; i <= across; i++) {
        const [position, normal] = at(i / across, j / along);
        this.positions.push(position);
        this.normals.push(normal);
      }
    for (let j = 0; j < along; j++)
      for (let i = 0; i < across; i++) {
        const a = first + j * (across + 1) + i, b = a + across + 1;
        this.indices.push(a, a + 1, b + 1, a, b + 1, b);
      }
    return this;
  }

  sphere(centre, radius) {
    return this.sheet(48, 24, (u, v) => {
      const [a, b] = [2 * Math.PI * u, Math.PI * (v - 0.5)];
      const normal = [Math.cos(b) * Math.sin(a), Math.sin(b), Math.cos(b) * Math.cos(a)];
      return [add(centre, normal, radius), normal];
    });
  }

  /** A body of revolution around +y: radius and height at each step. */
  turned(centre, profile) {
    for (let k = 1; k < profile.length; k++) {
      const [[r, y], [s, z]] = [profile[k - 1], profile[k]];
      const [out, up] = unit([z - y, r - s, 0]);
      this.sheet(32, 1, (u, v) => {
        const [x, w] = [Math.sin(2 * Math.PI * u), Math.cos(2 * Math.PI * u)], radius = v ? s : r;
        return [add(centre, [radius * x, v ? z : y, radius * w]), [out * x, up, out * w]];
      });
    }
    return this;
  }

  box([x, y, z], [w, h, d]) {
    for (const axis of [0, 1, 2])
      for (const side of [-1, 1]) {
        const normal = [0, 0, 0], u = [0, 0, 0], half = [w / 2, h / 2, d / 2];
        normal[axis] = side;
        u[(axis + 1) % 3] = 1;
        const v = cross(normal, u);
        this.sheet(1, 1, (i, j) => [[x, y, z].map((c, k) => c + half[k] *
          (normal[k] + u[k] * (2 * i - 1) + v[k] * (2 * j - 1))), normal]);
      }
    return this;
  }

  /** A tube along a closed curve. */
  tube(curve, radius, steps = 160) {
    return this.sheet(16, steps, (u, v) => {
      const centre = curve(v), ahead = unit(add(curve(v + 1e-3), centre, -1));
      const side = unit(cross(ahead, [0.1, 1, 0.2])), top = cross(side, ahead), a = -2 * Math.PI * u;
      const normal = add(side.map(c => c * Math.cos(a)), top, Math.sin(a));
      return [add(centre, normal, radius), normal];
    });
  }
}

/** Numbers that look like chance and are the same each time (a linear congruence). */
function chance() {
  let state = 7;
  return () => (state = (state * 1664525 + 1013904223) % 2 ** 32) / 2 ** 32;
}

function stillLife() {
  return [
    new Mesh(CLAY).turned([-0.75, 0, 0.1], [[0, 0], [0.28, 0], [0.36, 0.25], [0.34, 0.5], [0.14, 0.75],
      [0.2, 0.9], [0.16, 0.9], [0.1, 0.75], [0, 0.7]]),
    new Mesh(SEA, 0.35).sphere([0.1, 0.3, 0.45], 0.3).sphere([0.55, 0.15, 0.75], 0.15),
    new Mesh(STONE).box([0.75, 0.3, -0.2], [0.6, 0.6, 0.6]),
    new Mesh(IRON, 0.4).tube(t => {
      const a = 4 * Math.PI * t, r = 0.26 + 0.1 * Math.cos(1.5 * a);
      return [0.75 + r * Math.cos(a), 1.02 + 0.1 * Math.sin(1.5 * a) + 0.25 * Math.sin(a), -0.2 + r * Math.sin(a) * 0.9];
    }, 0.055),
  ];
}

function colonnade() {
  const stone = new Mesh(STONE), iron = new Mesh(IRON);
  for (let i = 0; i < 5; i++) {
    const at = [1.2 * (i - 2), 0, -0.6];
    stone.box(add(at, [0, 0.05, 0]), [0.5, 0.1, 0.5]).box(add(at, [0, 2.25, 0]), [0.5, 0.1, 0.5])
      .turned(at, [[0.19, 0.1], [0.17, 1.2], [0.14, 2.1], [0.22, 2.2]]);
  }
  stone.box([0, 2.4, -0.6], [5.6, 0.2, 0.55]);
  for (let i = 0; i < 33; i++) iron.box([0.17 * (i - 16), 0.4, 0.8], [0.025, 0.8, 0.025]);
  iron.box([0, 0.7, 0.8], [5.6, 0.03, 0.03]).box([0, 0.15, 0.8], [5.6, 0.03, 0.03]);
  return [stone, iron, new Mesh(CLAY).sphere([-0.6, 0.25, 0.1], 0.25)];
}

function leaves() {
  const next = chance(), leaf = new Mesh(LEAF), bark = new Mesh([0.25, 0.16, 0.1]);
  bark.turned([0, 0, 0], [[0.16, 0], [0.1, 0.5], [0.08, 1.4], [0, 1.9]]);
  for (let i = 0; i < 900; i++) {
    const a = 2 * Math.PI * next(), b = Math.acos(2 * next() - 1), r = 0.9 * next() ** 0.4;
    const at = [r * Math.sin(b) * Math.cos(a), 1.75 + 0.75 * r * Math.cos(b), r * Math.sin(b) * Math.sin(a)];
    const u = unit([next() - 0.5, next() - 0.5, next() - 0.5]), v = unit(cross(u, [0.3, 1, 0.2]));
    const normal = cross(u, v), size = 0.07 + 0.05 * next();
    for (const side of [1, -1]) // seen from both
      leaf.sheet(1, 1, (i, j) => [add(add(at, u, size * side * (i - 0.5)), v, 0.6 * size * (j - 0.5)),
        normal.map(c => c * side)]);
  }
  return [leaf, bark, new Mesh(STONE).box([0.9, 0.2, 0.5], [0.9, 0.08, 0.35])
    .box([0.6, 0.08, 0.5], [0.08, 0.16, 0.3]).box([1.2, 0.08, 0.5], [0.08, 0.16, 0.3])];
}

/** Meshes as a .glb (glTF 2.0, section 4). */
function encode(meshes) {
  const views = [], accessors = [], pieces = [];
  let at = 0;
  const store = (array, target, accessor) => {
    views.push({ buffer: 0, byteOffset: at, byteLength: array.byteLength, target });
    pieces.push([at, array]);
    at += array.byteLength;
    return accessors.push({ bufferView: views.length - 1, ...accessor }) - 1;
  };
  const primitives = meshes.map((mesh, material) => {
    const bound = pick => [0, 1, 2].map(axis => mesh.positions.reduce((most, p) => pick(most, p[axis]),
      mesh.positions[0][axis]));
    const vectors = (list, extra) => store(new Float32Array(list.flat()), 34962,
      { componentType: 5126, count: list.length, type: "VEC3", ...extra });
    return { material, attributes: { POSITION: vectors(mesh.positions, { min: bound((a, b) =>
      Math.min(a, Math.fround(b))), max: bound((a, b) => Math.max(a, Math.fround(b))) }),
    NORMAL: vectors(mesh.normals) }, indices: store(new Uint32Array(mesh.indices), 34963,
      { componentType: 5125, count: mesh.indices.length, type: "SCALAR" }) };
  });
  const materials = meshes.map(({ color, roughness }) => ({ pbrMetallicRoughness: {
    baseColorFactor: [...color, 1], metallicFactor: 0, roughnessFactor: roughness } }));
  let text = JSON.stringify({ asset: { version: "2.0" }, scene: 0, scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }], meshes: [{ primitives }], materials, accessors, bufferViews: views,
    buffers: [{ byteLength: at }] });
  text += " ".repeat((4 - text.length % 4) % 4); // all of it is ASCII
  const file = new ArrayBuffer(28 + text.length + at), view = new DataView(file), bytes = new Uint8Array(file);
  const word = (offset, ...values) => values.forEach((value, i) => view.setUint32(offset + 4 * i, value, true));
  word(0, 0x46546c67, 2, file.byteLength, text.length, 0x4e4f534a);
  bytes.set(new TextEncoder().encode(text), 20);
  word(20 + text.length, at, 0x004e4942);
  for (const [offset, array] of pieces)
    bytes.set(new Uint8Array(array.buffer), 28 + text.length + offset);
  return file;
}

const MAKERS = { "Still life": stillLife, "Colonnade": colonnade, "Leaves": leaves };

/** A built-in scene as a file. */
export const sample = name => new File([encode(MAKERS[name]())], name + ".glb",
  { type: "model/gltf-binary" });
