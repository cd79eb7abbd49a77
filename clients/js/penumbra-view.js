/**
 * `<penumbra-view server scene technique orbit>`: a rendered view for any page. A daemon serves it
 * at /penumbra-view.js; see docs/howto/view.md. What needs no document (Orbit, Pace, Latest) is
 * exported.
 */
import { Penumbra, PenumbraError } from "./penumbra.js";

const RADIANS = Math.PI / 180;
const STEEPEST_DEG = 89;
const REST_MS = 150; // after the last movement
const QUICK_MS = 250; // between two changes that are a movement, as of a slider or a light
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/** A camera that looks at a point from a distance, +y up. */
export class Orbit {
  /** Degrees from +z towards +x, and above the horizon; metres. */
  constructor({ target = [0, 0, 0], azimuth_deg = 35, elevation_deg = 25, distance = 1,
    fov_y_deg = 45 } = {}) {
    Object.assign(this, { target: [...target], azimuth_deg, elevation_deg, distance, fov_y_deg });
  }

  /** The orbit of a camera with `eye`, `target` and `fov_y_deg`. */
  static from({ eye, target, fov_y_deg = 45 }) {
    const [x, y, z] = eye.map((value, axis) => value - target[axis]);
    const distance = Math.hypot(x, y, z);
    return new Orbit({ target, distance, fov_y_deg, azimuth_deg: Math.atan2(x, z) / RADIANS,
      elevation_deg: Math.asin(clamp(y / distance, -1, 1)) / RADIANS });
  }

  /** Unit vectors: from the target to the eye, to the right and up in the picture. */
  get axes() {
    const a = this.azimuth_deg * RADIANS, e = this.elevation_deg * RADIANS;
    const [sa, ca, se, ce] = [Math.sin(a), Math.cos(a), Math.sin(e), Math.cos(e)];
    return { back: [ce * sa, se, ce * ca], right: [ca, 0, -sa], up: [-se * sa, ce, -se * ca] };
  }

  /** As a request's camera. */
  get camera() {
    const { back } = this.axes;
    return { eye: this.target.map((value, axis) => value + this.distance * back[axis]),
      target: [...this.target], up: [0, 1, 0], fov_y_deg: this.fov_y_deg };
  }

  /** The content follows the pointer: to the right means the camera goes left. */
  turn(right_deg, down_deg) {
    this.azimuth_deg = ((this.azimuth_deg - right_deg + 180) % 360 + 360) % 360 - 180;
    this.elevation_deg = clamp(this.elevation_deg + down_deg, -STEEPEST_DEG, STEEPEST_DEG);
  }

  /** Moves what is at the target's distance by so many heights of the picture. */
  pan(right, down) {
    const height = 2 * this.distance * Math.tan(this.fov_y_deg * RADIANS / 2);
    const axes = this.axes;
    this.target = this.target.map((value, axis) =>
      value + height * (down * axes.up[axis] - right * axes.right[axis]));
  }

  /** Multiplies the distance. */
  zoom(factor) {
    this.distance = clamp(this.distance * factor, 1e-6, 1e9);
  }
}

/** How small a picture has to be to take `budgetMs`: each level has half the pixels of the last. */
export class Pace {
  constructor(budgetMs = 70, levels = 6) {
    Object.assign(this, { budgetMs, levels, level: 2 });
  }

  /** Of a side of the full picture. */
  get scale() {
    return 2 ** (-this.level / 2);
  }

  /** What a picture of this level took. */
  note(ms) {
    if (ms > 1.3 * this.budgetMs) this.level += Math.ceil(Math.log2(ms / this.budgetMs));
    else if (2 * ms < 0.8 * this.budgetMs) this.level--;
    this.level = clamp(this.level, 0, this.levels - 1);
  }
}

/**
 * One answer at a time, and always to the newest question: what came between is never asked. A
 * question aborts the one under way, unless both are `brief`: those are let through to the end, or
 * nothing would be shown during a movement.
 */
export class Latest {
  #answer;
  #current = null;
  #next = null;
  #idle = [];

  /** `answer(question, signal)` returns a promise and handles its own errors. */
  constructor(answer) {
    this.#answer = answer;
  }

  ask(question) {
    this.#next = question;
    if (!this.#current) this.#begin();
    else if (!(question.brief && this.#current.question.brief)) this.#current.controller.abort();
  }

  /** Drops all questions. */
  stop() {
    this.#next = null;
    this.#current?.controller.abort();
  }

  /** Resolves when nothing is asked any more. */
  idle() {
    return this.#current ? new Promise(resolve => this.#idle.push(resolve)) : Promise.resolve();
  }

  async #begin() {
    while (this.#next) {
      const question = this.#next, controller = new AbortController();
      this.#next = null;
      this.#current = { question, controller };
      try {
        await this.#answer(question, controller.signal);
      } catch (reason) {
        if (!controller.signal.aborted) globalThis.reportError?.(reason);
      }
    }
    this.#current = null;
    this.#idle.splice(0).forEach(resolve => resolve());
  }
}

const STYLE = `
  :host { display: block; position: relative; overflow: hidden; aspect-ratio: 4 / 3;
    contain: content; font: 13px/1.4 system-ui, sans-serif; background: #8881; }
  :host([hidden]) { display: none; }
  canvas { display: block; width: 100%; height: 100%; object-fit: contain; }
  :host([orbit]) canvas { cursor: grab; touch-action: none; }
  :host([orbit]) canvas:active { cursor: grabbing; }
  canvas:focus-visible { outline: 2px solid Highlight; outline-offset: -2px; }
  [part=progress] { position: absolute; inset: auto 0 0 0; height: 2px; background: #d98324;
    transform-origin: left; transform: scaleX(0); opacity: 0; transition: opacity .15s; }
  [part=progress].on { opacity: 1; }
  [part=status] { position: absolute; left: 8px; bottom: 8px; max-width: calc(100% - 16px);
    padding: 2px 8px; border-radius: 4px; background: #000b; color: #fff; pointer-events: none; }
  [part=status]:empty { display: none; }
  .unseen { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); }
  slot { pointer-events: none; }
  ::slotted(*) { pointer-events: auto; }
  @media (prefers-reduced-motion: reduce) { [part=progress] { transition: none; } }
`;
const SHELL = `<canvas part="picture" role="img" aria-describedby="keys"></canvas>
  <slot></slot><div part="progress"></div>
  <div part="status" role="status" aria-live="polite"></div>
  <span id="keys" class="unseen"></span>`;
const KEYS = "Arrow keys turn, with Shift they move, plus and minus zoom, Home returns.";
const STRINGS = ["server", "scene", "technique", "token", "alt"];
const OBJECTS = ["params", "lights", "camera", "request"];
const NUMBERS = ["width", "height"];

/** Outside of browsers the module can be read for what it exports. */
const Base = globalThis.HTMLElement ?? class {};

export class PenumbraView extends Base {
  static observedAttributes = [...STRINGS, ...OBJECTS, ...NUMBERS, "orbit"];
  #given = {}; // properties, by name
  #client = null;
  #orbit = null; // known from the first picture on
  #home = null;
  #held = null; // lights as the first picture had them: else they would go with the camera
  #pace = new Pace();
  #latest = new Latest((question, signal) => this.#answer(question, signal));
  #pointers = new Map();
  #rest = 0;
  #due = false;
  #changedAt = -QUICK_MS;
  #parts;
  #asked = ""; // the size of the last question
  #size = new ResizeObserver(() => this.#asked && this.#asked !== this.#shown && this.#ask());

  constructor() {
    super();
    const root = this.attachShadow({ mode: "open", delegatesFocus: true });
    const sheet = new CSSStyleSheet(); // unlike a style element, no matter for the page's policy
    sheet.replaceSync(STYLE);
    root.adoptedStyleSheets = [sheet];
    root.innerHTML = SHELL;
    const [canvas, , progress, status, keys] = root.children;
    this.#parts = { canvas, progress, status, keys };
    for (const kind of ["pointerdown", "pointermove", "pointerup", "pointercancel"])
      canvas.addEventListener(kind, event => this.#point(event));
    canvas.addEventListener("wheel", event => this.#wheel(event), { passive: false });
    canvas.addEventListener("keydown", event => this.#key(event));
    canvas.addEventListener("contextmenu", event => this.orbit && event.preventDefault());
  }

  connectedCallback() {
    for (const name of PenumbraView.observedAttributes) // set before the element was defined
      if (Object.hasOwn(this, name)) {
        const value = this[name];
        delete this[name];
        this[name] = value;
      }
    this.#size.observe(this);
    this.#dress();
    this.#ask();
  }

  disconnectedCallback() {
    this.#size.disconnect();
    clearTimeout(this.#rest);
    this.#latest.stop();
  }

  attributeChangedCallback(name, before, after) {
    if (before === after) return;
    delete this.#given[name];
    this.#changed(name);
  }

  /** The camera as it is now, or null before the first picture. */
  get currentCamera() {
    return this.#orbit?.camera ?? null;
  }

  /** Returns to the camera of the first picture. */
  resetCamera() {
    if (!this.#home) return;
    this.#orbit = Orbit.from(this.#home);
    this.#moved();
  }

  /** Renders again, for instance when the same scene was given another light. */
  refresh() {
    this.#ask();
  }

  /** @internal A property that an attribute of the same name stands for. */
  _read(name) {
    if (name in this.#given) return this.#given[name];
    const text = this.getAttribute(name);
    if (text === null || STRINGS.includes(name)) return text;
    if (NUMBERS.includes(name)) return Number(text) || null;
    try {
      return JSON.parse(text);
    } catch (reason) {
      this.#fail(new PenumbraError({ title: "The attribute " + name + " is no JSON." }));
      return null;
    }
  }

  /** @internal Objects, and the token, stay out of the document. */
  _write(name, value) {
    if (OBJECTS.includes(name) || name === "token") {
      this.#given[name] = value;
      this.#changed(name);
    } else if (value === null || value === undefined) this.removeAttribute(name);
    else this.setAttribute(name, value);
  }

  get orbit() {
    return this.hasAttribute("orbit");
  }

  set orbit(on) {
    this.toggleAttribute("orbit", Boolean(on));
  }

  // ---- questions ----

  #changed(name) {
    if (name === "server" || name === "token") this.#client = null;
    if (["server", "scene", "camera"].includes(name)) this.#orbit = this.#home = null;
    if (["server", "scene", "lights"].includes(name)) this.#held = null;
    this.#dress();
    if (["server", "scene"].includes(name)) this.#changedAt = -QUICK_MS;
    this.#ask({ change: true });
  }

  #dress() {
    const { canvas, keys } = this.#parts;
    canvas.setAttribute("aria-label", this.alt ?? "Rendered view");
    canvas.tabIndex = this.orbit ? 0 : -1;
    keys.textContent = this.orbit ? KEYS : "";
  }

  /** Several changes at once are one question, and in quick succession a movement. */
  #ask({ change = false } = {}) {
    clearTimeout(this.#rest);
    if (this.#due) return;
    this.#due = true;
    queueMicrotask(() => {
      this.#due = false;
      if (!this.isConnected || !this.scene) return;
      const now = performance.now(), quick = change && now - this.#changedAt < QUICK_MS;
      if (change) this.#changedAt = now;
      if (quick) this.#glide();
      else this.#latest.ask({ brief: false });
    });
  }

  /** Small pictures now, the full one at rest. */
  #glide() {
    clearTimeout(this.#rest);
    this.#latest.ask({ brief: true });
    this.#rest = setTimeout(() => this.#ask(), REST_MS);
  }

  get #shown() {
    return this.clientWidth + " " + this.clientHeight;
  }

  #request(brief) {
    this.#asked = this.#shown;
    const ratio = Math.min(globalThis.devicePixelRatio || 1, 2);
    const scale = brief ? this.#pace.scale : 1;
    const side = (given, shown) => Math.max(1, Math.round((given ?? shown * ratio) * scale));
    const request = { ...(this.lights ? {} : this.#held), ...this.request,
      width: side(this.width, this.clientWidth || 640),
      height: side(this.height, this.clientHeight || 480) };
    const name = this.technique, params = this.params;
    if (name) request.technique = params ? { name, params } : name;
    if (this.lights) request.lights = this.lights;
    if (this.#orbit) request.camera = this.#orbit.camera;
    else if (this.camera) request.camera = this.camera;
    if (brief) request.output = { ...request.output, format: "jpeg" };
    return request;
  }

  async #answer({ brief }, signal) {
    for (let tried = 0; !signal.aborted; tried++) {
      try {
        await (brief ? this.#glance(signal) : this.#look(signal));
        return;
      } catch (reason) {
        if (signal.aborted) return;
        const failure = reason instanceof PenumbraError ? reason :
          new PenumbraError({ title: "The picture cannot be shown: " + reason.message });
        this.#fail(failure, failure.retryable);
        if (!failure.retryable) return;
        const ms = failure.retryAfterMs ?? Math.min(500 * 2 ** tried, 8000);
        await new Promise(resolve => {
          const timer = setTimeout(resolve, ms);
          signal.addEventListener("abort", () => { clearTimeout(timer); resolve(); });
        });
      }
    }
  }

  get #server() {
    // Its own retries are of no use here: the question may be another meanwhile.
    return this.#client ??= new Penumbra(this.server ?? undefined,
      { token: this.token ?? "", retries: 0 });
  }

  /** A small picture of a movement. */
  async #glance(signal) {
    const begun = performance.now();
    const picture = await this.#server.render(this.scene, this.#request(true), { signal });
    await this.#draw(picture.blob, signal);
    const ms = performance.now() - begun;
    this.#pace.note(ms);
    this.#say("");
    this.#tell("timing", { ms, stages: picture.timings, brief: true });
  }

  /** The full picture, as it gets better. */
  async #look(signal) {
    const begun = performance.now(), { progress } = this.#parts;
    progress.style.transform = "scaleX(0)";
    progress.classList.add("on");
    try {
      for await (const { record, picture, done } of
        this.#server.refine(this.scene, this.#request(false), { signal })) {
        await this.#draw(picture.blob, signal);
        this.#adopt(record.request);
        const ms = performance.now() - begun, { samples, of } = record.progress;
        progress.style.transform = "scaleX(" + (of ? samples / of : 1) + ")";
        if (done) this.#say("");
        this.#tell("load", { record, blob: picture.blob, warnings: record.warnings, done });
        const { stages_ms: stages, passes } = record;
        if (done) this.#tell("timing", { ms, stages, passes, brief: false });
      }
    } finally {
      progress.classList.remove("on");
    }
  }

  /** What the daemon chose is kept while the view moves. */
  #adopt({ camera, lights, exposure_ev, sky_level }) {
    if (!this.#orbit && camera?.eye) {
      this.#home = camera;
      this.#orbit = Orbit.from(camera);
      this.#tell("camerachange", { camera: this.#orbit.camera, user: false });
    }
    this.#held ??= { lights, exposure_ev, sky_level };
  }

  async #draw(blob, signal) {
    const bitmap = await createImageBitmap(blob), { canvas } = this.#parts;
    if (signal.aborted) throw signal.reason;
    Object.assign(canvas, { width: bitmap.width, height: bitmap.height });
    canvas.getContext("2d").drawImage(bitmap, 0, 0);
    bitmap.close();
  }

  #fail(failure, again = false) {
    this.#say(failure.message + (again ? " Trying again." : ""));
    this.#tell("error", { error: failure, again });
  }

  #say(text) {
    const { status } = this.#parts;
    if (status.textContent !== text) status.textContent = text;
  }

  #tell(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  // ---- movements ----

  #moved() {
    this.#tell("camerachange", { camera: this.#orbit.camera, user: true });
    this.#glide();
  }

  get #moves() {
    return this.orbit && this.#orbit;
  }

  #point(event) {
    const { canvas } = this.#parts, pointers = this.#pointers;
    const before = pointers.get(event.pointerId);
    const at = { x: event.clientX, y: event.clientY };
    if (event.type === "pointerdown" && this.#moves) {
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, at);
    } else if (event.type === "pointermove" && before && this.#moves) {
      const height = canvas.clientHeight || 1, [dx, dy] = [at.x - before.x, at.y - before.y];
      if (!dx && !dy) return;
      if (pointers.size > 1) {
        const [first, second] = pointers.values(), other = first === before ? second : first;
        const apart = p => Math.hypot(p.x - other.x, p.y - other.y) || 1;
        this.#orbit.zoom(apart(before) / apart(at));
        this.#orbit.pan(dx / height / 2, dy / height / 2); // the middle moves by half
      } else if (event.buttons & 6 || event.shiftKey || event.ctrlKey) {
        this.#orbit.pan(dx / height, dy / height);
      } else {
        this.#orbit.turn(180 * dx / height, 180 * dy / height);
      }
      pointers.set(event.pointerId, at);
      this.#moved();
    } else if (event.type !== "pointermove" && pointers.delete(event.pointerId) && !pointers.size) {
      this.#ask();
    }
  }

  #wheel(event) {
    if (!this.#moves) return;
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : event.deltaMode === 2 ? 400 : 1;
    this.#orbit.zoom(Math.exp(clamp(event.deltaY * lines, -400, 400) / 600));
    this.#moved();
  }

  #key(event) {
    if (!this.#moves || event.altKey || event.ctrlKey || event.metaKey) return;
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1],
      ArrowDown: [0, 1] }[event.key];
    if (arrow && event.shiftKey) this.#orbit.pan(arrow[0] / 20, arrow[1] / 20);
    else if (arrow) this.#orbit.turn(5 * arrow[0], 5 * arrow[1]);
    else if (event.key === "+" || event.key === "=") this.#orbit.zoom(1 / 1.1);
    else if (event.key === "-") this.#orbit.zoom(1.1);
    else if (event.key === "Home") this.#orbit = Orbit.from(this.#home);
    else return;
    event.preventDefault();
    this.#moved();
  }
}

for (const name of [...STRINGS, ...OBJECTS, ...NUMBERS])
  Object.defineProperty(PenumbraView.prototype, name, {
    configurable: true,
    enumerable: true,
    get() { return this._read(name); },
    set(value) { this._write(name, value); },
  });

if (globalThis.customElements && !customElements.get("penumbra-view"))
  customElements.define("penumbra-view", PenumbraView);
