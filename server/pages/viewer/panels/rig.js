// The lights that are edited: what each type has, and the changes to them. Before the first change
// they are the scene's own, or the daemon's; from then on they stand in the address, together with
// the exposure and the sky that they were seen with, so that a light can be made darker.
import { across, add, length, minus, times, unit } from "../lens.js";

/** Sizes of each type, as rows of a panel. */
export const SIZES = {
  rect: [["width", "m"], ["height", "m"]],
  disk: [["radius", "m"]],
  sphere: [["radius", "m"]],
  sun: [["angular_diameter_deg", "deg", 0, 60]],
  point: [],
  spot: [["outer_cone_deg", "deg", 0.1, 89], ["inner_cone_deg", "deg", 0, 89]],
};
const KEPT = ["position", "target", "up", "color"]; // by a light that becomes one of another type

/** What says how strong a light is, and in which unit. */
export function strength(light) {
  if (light.type === "sun") return ["irradiance", "W/m²"];
  return light.radiance > 0 && !light.power_w ? ["radiance", "W/m²/sr"] : ["power_w", "W"];
}

/** Watts per square metre on a surface that faces the light at its target. */
function irradiance(light) {
  if (light.type === "sun") return light.irradiance;
  const far = length(minus(light.position, light.target)) || 1;
  const area = light.type === "rect" ? light.width * light.height : Math.PI * (light.radius ?? 0) ** 2;
  if (light.radiance > 0 && !light.power_w) return light.radiance * area / far ** 2;
  return light.power_w / (solidAngle(light) * far ** 2);
}

/** Power over the intensity along the axis. */
function solidAngle({ type, inner_cone_deg = 0, outer_cone_deg = 45 }) {
  if (type === "point" || type === "sphere") return 4 * Math.PI;
  if (type !== "spot") return Math.PI;
  const cosine = deg => Math.cos(deg * Math.PI / 180);
  return 2 * Math.PI * Math.max(1 - (cosine(inner_cone_deg) + cosine(outer_cone_deg)) / 2, 1e-4);
}

/** The same light as one of another type: as bright where it points, and about as large. */
export function retyped(light, type) {
  if (light.type === type) return light;
  const far = length(minus(light.position, light.target)) || 1;
  const side = light.width ? Math.sqrt(light.width * light.height) :
    light.radius ? light.radius * Math.sqrt(Math.PI) : far / 5;
  const made = { type, ...Object.fromEntries(KEPT.filter(key => key in light).map(key =>
    [key, light[key]])) };
  if (type === "rect") Object.assign(made, { width: round(side), height: round(side) });
  if (type === "disk" || type === "sphere") made.radius = round(side / Math.sqrt(Math.PI));
  if (type === "sun") made.angular_diameter_deg = 0.53;
  if (type === "spot") Object.assign(made, { inner_cone_deg: 15, outer_cone_deg: 25 });
  const bright = irradiance(light);
  if (type === "sun") made.irradiance = round(bright);
  else made.power_w = round(bright * solidAngle(made) * far ** 2);
  return made;
}

/** Where a light is drawn: a sun, of which only the direction counts, at `reach` from its target. */
export function place({ type, position, target }, reach) {
  return type === "sun" ? add(target, unit(minus(position, target)), reach) : position;
}

/** Unit vectors of the emitter: where it faces, its x and its y. */
export function axesOf({ position, target, up }) {
  const forward = unit(minus(target, position));
  return [forward, ...across(forward, up)];
}

/** A circle as points. */
function ring(centre, a, b, radius) {
  return Array.from({ length: 40 }, (_, i) => {
    const angle = i * Math.PI / 20;
    return add(add(centre, a, radius * Math.cos(angle)), b, radius * Math.sin(angle));
  });
}

/**
 * What is drawn of a light, in the world: its `outline`; `size`, the point on it that changes it, or
 * null; and `plane`, in which that point is moved: a point and a normal.
 */
export function shape(light, reach, lens) {
  const at = place(light, reach), [forward, x, y] = axesOf(light);
  if (light.type === "rect") {
    const [w, h] = [light.width / 2, light.height / 2];
    const corner = (i, j) => add(add(at, x, i * w), y, j * h);
    return { outline: [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)],
      size: corner(1, 1), plane: [at, forward] };
  }
  if (light.type === "spot") {
    const wide = length(minus(light.target, at)) * Math.tan(light.outer_cone_deg * Math.PI / 180);
    return { outline: ring(light.target, x, y, wide), size: add(light.target, x, wide),
      plane: [light.target, forward], apex: at };
  }
  if (light.type === "point") return { outline: [], size: null };
  const faces = light.type === "disk" ? [x, y] : [lens.right, lens.up];
  const radius = light.type === "sun" ?
    reach * Math.tan(light.angular_diameter_deg * Math.PI / 360) : light.radius;
  return { outline: ring(at, ...faces, radius), size: add(at, faces[0], radius),
    plane: [at, light.type === "disk" ? forward : lens.forward] };
}

/** The sizes of a light whose point of size was moved to `point`. */
export function sized(light, reach, point) {
  const at = place(light, reach), [, x, y] = axesOf(light), to = minus(point, at);
  const least = 1e-4 * reach, along = axis => Math.max(2 * Math.abs(to[0] * axis[0] + to[1] * axis[1] +
    to[2] * axis[2]), least);
  if (light.type === "rect") return { width: round(along(x)), height: round(along(y)) };
  if (light.type === "spot") {
    const outer = Math.atan2(length(minus(point, light.target)), length(minus(light.target, at)));
    const outer_cone_deg = round(Math.min(Math.max(outer * 180 / Math.PI, 0.5), 89));
    return { outer_cone_deg, inner_cone_deg: Math.min(light.inner_cone_deg ?? 0, outer_cone_deg) };
  }
  if (light.type === "sun")
    return { angular_diameter_deg: round(Math.min(Math.atan2(length(to), reach) * 360 / Math.PI, 60)) };
  return { radius: round(Math.max(length(to), least)) };
}

/** Five figures: positions in an address stay short. */
export const round = value => Array.isArray(value) ? value.map(round) : Number(value.toPrecision(5));

export class Rig extends EventTarget {
  #store;
  #api;
  #defaults = [];
  #asked = "";
  /** Number of the light that is edited, from 0. */
  selected = 0;

  constructor(store, api) {
    super();
    this.#store = store;
    this.#api = api;
    store.on(["lights"], () => this.#tell());
    store.on(["scene", "variant", "animation"], () => { this.#defaults = []; this.selected = 0; });
    api.on("picture", ({ record }) => {
      if (!store.get("lights")) this.#defaults = record.request.lights;
      else this.#find();
      this.#tell();
    });
  }

  /** The lights as they are, complete. */
  get lights() {
    return this.#store.get("lights") ?? this.#defaults;
  }

  get light() {
    return this.lights[this.selected];
  }

  /** Whether the lights are known: the address says them, or a picture has come. */
  get known() {
    return this.touched || Boolean(this.#api.record);
  }

  /** Whether they are others than the scene came with. */
  get touched() {
    return this.#store.get("lights") !== null;
  }

  /** The radius of the scene, metres. */
  get reach() {
    const bounds = this.#api.scene?.bounds;
    return bounds ? length(minus(bounds.max, bounds.min)) / 2 || 1 : 1;
  }

  /** What light `number` returns to; undefined while that is not known. */
  base(number = this.selected) {
    if (!this.#defaults.length) return undefined;
    const base = this.#defaults[number] ?? this.#another(number);
    return retyped(base, this.lights[number]?.type ?? base.type);
  }

  select(number) {
    this.selected = number;
    this.#tell();
  }

  next() {
    this.select((this.selected + 1) % (this.lights.length || 1));
  }

  /** Changes the light that is edited; `push`: the back button returns to what was before. */
  change(changes, how) {
    this.#set(this.lights.map((light, i) => i === this.selected ? { ...light, ...changes } : light), how);
  }

  /** Puts another light in its place. */
  replace(light) {
    this.#set(this.lights.map((old, i) => i === this.selected ? light : old), { push: true });
  }

  add() {
    this.#set([...this.lights, this.#another(this.lights.length)], { push: true });
    this.select(this.lights.length - 1);
  }

  remove() {
    this.#set(this.lights.filter((light, i) => i !== this.selected), { push: true });
    this.select(this.selected);
  }

  /** Back to the scene's own. */
  reset() {
    this.#store.set({ lights: null, held: null }, { push: true });
    this.select(0);
  }

  #set(lights, how) {
    const seen = this.#api.record?.request;
    const held = this.#store.get("held") ?? (seen && { exposure_ev: round(seen.exposure_ev -
      this.#store.get("exposure")), sky_level: round(seen.sky_level) });
    this.#store.set({ lights, held }, how);
  }

  /** A further light like the first, from elsewhere around its target, and of its own colour. */
  #another(number) {
    const first = this.#defaults[0] ?? this.lights[0] ?? { type: "rect", position: [0, 2 * this.reach, 0],
      target: [0, 0, 0], width: this.reach / 4, height: this.reach / 4, power_w: 40 * this.reach ** 2 };
    const angle = number * 2.4, [x, y, z] = minus(first.position, first.target);
    const [sine, cosine] = [Math.sin(angle), Math.cos(angle)];
    const { texture, ...rest } = first;
    return { ...rest, position: round(add(first.target, [x * cosine + z * sine, y,
      z * cosine - x * sine])) };
  }

  /** Asks what the lights would be, where the address says others. */
  async #find() {
    const { scene, variant, animation } = this.#store.state;
    const key = [scene, variant, animation].join(" ");
    if (this.#defaults.length || this.#asked === key) return;
    this.#asked = key;
    const record = await this.#api.daemon.record(scene, { technique: "none", width: 32, height: 24,
      ...(variant && { variant }), ...(animation && { animation }) }).catch(() => null);
    if (!record || this.#defaults.length || this.#asked !== key) return;
    this.#defaults = record.request.lights;
    this.#tell();
  }

  #tell() {
    this.selected = Math.max(0, Math.min(this.selected, this.lights.length - 1));
    this.dispatchEvent(new Event("change"));
  }
}

/** Linear RGB from 0 to 1 as "#rrggbb", by the curve of sRGB; and back. */
export const toHex = color => "#" + color.map(value => {
  const c = Math.min(Math.max(value, 0), 1);
  const s = c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055;
  return Math.round(255 * s).toString(16).padStart(2, "0");
}).join("");
export const fromHex = hex => [1, 3, 5].map(at => {
  const s = parseInt(hex.slice(at, at + 2), 16) / 255;
  return round(s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4);
});
