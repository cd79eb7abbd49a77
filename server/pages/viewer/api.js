// The daemon, as the panels see it: what it told about itself, whether it is there, and what the
// picture shows at present.
import { Penumbra } from "../penumbra.js";

const SILENCE_MS = 8000; // of a stream that speaks once a second
const LONGEST_MS = 8000; // between two tries

/**
 * Events, each with its `detail`:
 * - `connection` {there, error, nextMs}: the daemon went away, is tried again, or is back
 * - `service`, `techniques`, `scenes`: what it says about itself, methods, list of scenes
 * - `scene`: the document of the scene that is looked at, or null
 * - `live`: what /v1/events says, once a second
 * - `picture` {record, blob, done}: what the view shows
 * - `problem` {error, about}: something that was asked for was refused; null: no more
 * - `token`: the daemon asks for one
 */
export class Api extends EventTarget {
  daemon;
  there = true;
  service = null;
  techniques = [];
  scenes = [];
  scene = null;
  live = null;
  /** The record of the picture that is shown. */
  record = null;
  blob = null;
  /** The request of the scene's first picture, as the daemon completed it: exposure, lights. */
  first = null;
  /** The element that shows the picture, and the box over it for handles and labels. */
  view = null;
  overlay = null;

  constructor() {
    super();
    this.#connect();
  }

  get token() {
    return sessionStorage.getItem("token") ?? "";
  }

  set token(token) {
    sessionStorage.setItem("token", token);
    this.#connect();
    this.tell("token", token);
    this.load().catch(reason => this.problem(reason));
  }

  tell(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  /** Calls `action(detail)` on each such event. */
  on(name, action) {
    this.addEventListener(name, event => action(event.detail));
  }

  /** Says what went wrong where everybody sees it, until the next `problem(null)`. */
  problem(error, about = "") {
    if (error?.status === 401) this.tell("token", "");
    this.tell("problem", error && { error, about });
  }

  /** An action whose errors are said. */
  guard(action, about = "") {
    return async (...given) => {
      try {
        return await action(...given);
      } catch (reason) {
        if (reason?.name !== "AbortError") this.problem(reason, about);
      }
    };
  }

  /** A method's document. */
  technique(name) {
    return this.techniques.find(technique => technique.name === name);
  }

  /** The schemas of the OpenAPI document, for lists that follow from it; asked for once. */
  schemas() {
    return this.#schemas ??= this.daemon.json("openapi.json").then(({ components }) =>
      components.schemas);
  }
  #schemas;

  #connect() {
    this.daemon = new Penumbra(undefined, { token: this.token, retries: 0 });
  }

  /** Asks for all that does not depend on what is looked at. */
  async load() {
    const [service, techniques] = await Promise.all([this.daemon.service(),
      this.daemon.techniques(), this.loadScenes()]);
    this.service = service;
    this.techniques = techniques;
    this.tell("service", service);
    this.tell("techniques", techniques);
  }

  async loadScenes() {
    const scenes = [];
    for await (const scene of this.daemon.scenes()) scenes.push(scene);
    this.scenes = scenes;
    this.tell("scenes", scenes);
  }

  /** Takes what is known of the scene that is looked at. */
  async loadScene(id) {
    this.scene = this.scenes.find(scene => scene.id === id) ?? null;
    this.first = null;
    this.tell("scene", this.scene);
    if (!id || this.scene) return;
    const scene = await this.daemon.scene(id);
    this.scene = scene;
    this.tell("scene", scene);
  }

  /** What the view shows now. */
  show(detail) {
    this.record = detail.record;
    this.blob = detail.blob;
    this.first ??= detail.record.request;
    this.tell("picture", detail);
  }

  /** Listens as long as the page is open; tries again when the daemon is away. */
  async watch() {
    for (let tried = 0; ; tried++) {
      const silent = new AbortController();
      let timer = 0;
      try {
        for await (const { data } of this.daemon.listen("v1/events", { signal: silent.signal })) {
          clearTimeout(timer);
          timer = setTimeout(() => silent.abort(), SILENCE_MS);
          tried = 0;
          this.#found();
          this.live = data;
          this.tell("live", data);
        }
      } catch (reason) {
        clearTimeout(timer);
        const nextMs = Math.min(500 * 2 ** tried, LONGEST_MS) * (0.75 + Math.random() / 2);
        this.there = false;
        if (reason.status === 401) this.tell("token", "");
        this.tell("connection", { there: false, error: reason, nextMs });
        await new Promise(resolve => {
          this.#hurry = resolve;
          setTimeout(resolve, nextMs);
        });
      }
    }
  }

  #hurry = () => {};
  /** Tries at once. */
  retry() {
    this.#hurry();
  }

  #found() {
    if (this.there) return;
    this.there = true;
    this.tell("connection", { there: true });
    this.load().catch(reason => this.problem(reason));
  }
}
