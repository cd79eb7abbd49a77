// What is looked at, as one object that is the address: reload, share and the back button work
// because nothing else is remembered.

const json = { read: text => JSON.parse(text), write: JSON.stringify };
const text = { read: text => text, write: String };
const number = { read: text => Number.isFinite(Number(text)) ? Number(text) : undefined, write: String };
const flag = { read: text => text !== "false", write: String };
const words = (...allowed) => ({ read: text => allowed.includes(text) ? text : undefined, write: String });

/** Every key of the state: how the address has it, and what it is when it is not there. */
export const KEYS = {
  scene: { ...text, start: null }, // an id; null: the first one stored
  technique: { ...text, start: "pcss" },
  params: { ...json, start: {} }, // of the method, by name; those left out have their defaults
  camera: { ...json, start: null }, // {eye, target, fov_y_deg} or {index}; null: frames the scene
  lights: { ...json, start: null }, // as in a request; null: the scene's own, or the daemon's
  held: { ...json, start: null }, // {exposure_ev, sky_level} that edited lights are seen with
  ground: { ...json, start: true }, // false, or "shadow"
  sky: { ...flag, start: true },
  sky_intensity: { ...number, start: 1 },
  exposure: { ...number, start: 0 }, // stops beside what the daemon chose
  tone_map: { ...text, start: "none" },
  variant: { ...text, start: "" },
  animation: { ...text, start: "" },
  time_s: { ...number, start: 0 },
  layer: { ...text, start: "beauty" },
  width: { ...number, start: null }, // px; null: as large as it is shown
  height: { ...number, start: null },
  antialias: { ...number, start: 1 },
  format: { ...text, start: "png" }, // of downloads
  b: { ...text, start: null }, // the method it is compared with; null: none
  map: { ...words("wipe", "difference", "ssim", "flip"), start: "wipe" },
  error: { ...words("rmse_penumbra", "rmse", "flip"), start: "rmse_penumbra" }, // of the chart
};

function read(address) {
  const state = {};
  for (const [key, kind] of Object.entries(KEYS)) {
    let value;
    try {
      value = address.has(key) ? kind.read(address.get(key)) : undefined;
    } catch (reason) {
      value = undefined; // somebody has edited it
    }
    state[key] = value === undefined ? kind.start : value;
  }
  return state;
}

const equal = (a, b) => a === b || JSON.stringify(a) === JSON.stringify(b);

export class Store {
  #listeners = new Set();
  #changed = new Set();
  #timer = 0;

  constructor() {
    this.state = read(new URLSearchParams(location.hash.slice(1)));
    // Both events come for one step back; the second changes nothing any more.
    for (const kind of ["popstate", "hashchange"])
      addEventListener(kind, () => this.#take(read(new URLSearchParams(location.hash.slice(1)))));
  }

  get(key) {
    return this.state[key];
  }

  /**
   * Changes some keys; undefined returns one to its start.
   * @param {object} changes
   * @param {{push?: boolean}} how `push`: the back button returns to what was before. Movements and
   *   sliders leave it out.
   */
  set(changes, { push = false } = {}) {
    const next = { ...this.state };
    for (const [key, value] of Object.entries(changes))
      next[key] = value === undefined ? KEYS[key].start : value;
    if (push) {
      this.#write();
      history.pushState(null, "", this.#address(next));
    } else {
      clearTimeout(this.#timer); // browsers refuse more than some hundred in half a minute
      this.#timer = setTimeout(() => this.#write(), 300);
    }
    this.#take(next);
  }

  /**
   * Calls `action(state, changed)` now and after changes of any of `keys`, once for all that are
   * made together; `changed` is a set of keys.
   * @returns {() => void} Ends it.
   */
  on(keys, action) {
    const listener = { keys, action };
    this.#listeners.add(listener);
    action(this.state, new Set(keys));
    return () => this.#listeners.delete(listener);
  }

  /** The address of the state, absolute. */
  get link() {
    return new URL(this.#address(this.state), location.href).href;
  }

  #address(state) {
    const address = new URLSearchParams();
    for (const [key, kind] of Object.entries(KEYS))
      if (!equal(state[key], kind.start)) address.set(key, kind.write(state[key]));
    return location.pathname + location.search + "#" + address;
  }

  #write() {
    clearTimeout(this.#timer);
    history.replaceState(null, "", this.#address(this.state));
  }

  #take(next) {
    const changed = Object.keys(KEYS).filter(key => !equal(this.state[key], next[key]));
    if (!changed.length) return;
    this.state = next;
    if (!this.#changed.size) queueMicrotask(() => this.#tell());
    for (const key of changed) this.#changed.add(key);
  }

  #tell() {
    const changed = this.#changed;
    this.#changed = new Set();
    for (const { keys, action } of [...this.#listeners])
      if (keys.some(key => changed.has(key))) action(this.state, changed);
  }
}

/** The keys that a picture depends on, besides its method, size and layer. */
export const VIEW_KEYS = ["scene", "camera", "lights", "held", "ground", "sky", "sky_intensity", "exposure",
  "tone_map", "variant", "animation", "time_s"];

/**
 * The fields of a render request that the state says and that are not what the daemon would choose
 * itself; without method, camera, lights, size and output.
 * @param {object} state
 * @param {number | undefined} chosenEv The exposure that the daemon chose for the scene, if known.
 */
export function requestOf(state, chosenEv) {
  const request = {};
  for (const key of ["ground", "sky", "sky_intensity", "tone_map", "variant", "animation",
    "antialias", "time_s"])
    if (!equal(state[key], KEYS[key].start)) request[key] = state[key];
  const ev = state.held?.exposure_ev ?? chosenEv;
  if ((state.exposure || state.held) && ev !== undefined) request.exposure_ev = ev + state.exposure;
  if (state.held) request.sky_level = state.held.sky_level;
  return request;
}

/** The method as a request has it. */
export function techniqueOf({ technique, params }) {
  return Object.keys(params).length ? { name: technique, params } : technique;
}
