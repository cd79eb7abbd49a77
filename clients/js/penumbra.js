/**
 * The JavaScript client of penumbra: browsers and Node 18 or later, no dependency. A daemon serves
 * it at /penumbra.js. Types of requests and answers are those of its /openapi.json.
 *
 * @typedef {import("./schemas").RenderRequest} RenderRequest
 * @typedef {import("./schemas").CompareRequest} CompareRequest
 * @typedef {import("./schemas").SequenceRequest} SequenceRequest
 * @typedef {import("./schemas").Comparison} Comparison
 * @typedef {import("./schemas").Record} RenderRecord
 * @typedef {import("./schemas").Scene} Scene
 * @typedef {import("./schemas").SceneChanges} SceneChanges
 * @typedef {import("./schemas").ImageInfo} ImageInfo
 * @typedef {import("./schemas").Service} Service
 * @typedef {import("./schemas").Stats} Stats
 * @typedef {import("./schemas").TechniqueInfo} TechniqueInfo
 * @typedef {import("./schemas").Job} Job
 * @typedef {import("./schemas").Problem} Problem
 * @typedef {Blob | ArrayBuffer | ArrayBufferView} Bytes
 * @typedef {{signal?: AbortSignal}} Options
 * @typedef {{event: string, id: string, data: any}} ServerEvent
 */

/** What the daemon refuses, or what kept it from answering. */
export class PenumbraError extends Error {
  /**
   * @param {Partial<Problem>} problem The problem document (RFC 9457).
   * @param {number | null} retryAfterMs Milliseconds until another try makes sense, if it was said.
   */
  constructor(problem, retryAfterMs = null) {
    super((problem.detail || problem.title || "The request failed.") +
      (problem.pointer ? " (" + problem.pointer + ")" : ""));
    this.name = "PenumbraError";
    this.problem = problem;
    /** HTTP status. */
    this.status = problem.status ?? 0;
    /** Whether the same request may succeed later. */
    this.retryable = problem.retryable ?? false;
    this.retryAfterMs = retryAfterMs;
  }
}

/** A rendered image with what its header says. */
export class Picture {
  #url = "";
  /**
   * @param {Blob} blob The image file.
   * @param {Headers} headers
   */
  constructor(blob, headers) {
    this.blob = blob;
    /** Milliseconds per stage, by name; `total` among them. */
    this.timings = parseTimings(headers.get("Server-Timing"));
    /** What the method could not do. */
    this.warnings = headers.get("X-Penumbra-Warning") ?? "";
    /** Why this method, when `auto` was asked for. */
    this.choice = headers.get("X-Penumbra-Choice") ?? "";
    this.etag = headers.get("ETag") ?? "";
    this.requestId = headers.get("X-Request-Id") ?? "";
  }

  /** A blob URL for `<img src>`; `release` gives it back. */
  get url() {
    return this.#url ||= URL.createObjectURL(this.blob);
  }

  /** Revokes the blob URL. */
  release() {
    if (this.#url) URL.revokeObjectURL(this.#url);
    this.#url = "";
  }
}

/** A job that goes on when its client has left. */
export class JobHandle {
  #client;
  /**
   * @param {Penumbra} client
   * @param {Job} job As it was when it was asked for.
   */
  constructor(client, job) {
    this.#client = client;
    this.id = job.id;
    this.job = job;
  }

  /**
   * What becomes of it until it is over: `state` events (data: the job) and `frame` events. When
   * the connection breaks it goes on behind the last event.
   * @param {Options & {after?: string}} options `after`: the id of the last event that is known.
   * @returns {AsyncGenerator<ServerEvent>}
   */
  async *events({ signal, after = "" } = {}) {
    for await (const event of this.#client.listen(this.job.links.events, { signal, after })) {
      if (event.event === "state") this.job = event.data;
      yield event;
    }
  }

  /**
   * Waits for its end.
   * @param {Options} options
   * @returns {Promise<Job>} The job, when it succeeded; else throws its problem.
   */
  async finished({ signal } = {}) {
    for await (const event of this.events({ signal })) void event;
    this.job = await this.#client.json(this.job.links.self, { signal });
    if (this.job.state !== "successful")
      throw new PenumbraError(this.job.error ?? { title: "The job was " + this.job.state + "." });
    return this.job;
  }

  /**
   * @param {number} number From 0 on.
   * @param {Options} options
   * @returns {Promise<Blob>} The image.
   */
  async frame(number, { signal } = {}) {
    return (await this.#client.call(this.job.links.frames + "/" + number, { signal })).blob();
  }

  /**
   * The file that holds the image, the comparison or all frames, once the job is over.
   * @param {Options} options
   * @returns {Promise<Blob>}
   */
  async result({ signal } = {}) {
    const { links } = this.job.links.result ? this.job : await this.finished({ signal });
    return (await this.#client.call(/** @type {string} */ (links.result), { signal })).blob();
  }

  /**
   * Cancels it, or removes it with its files when it is over.
   * @returns {Promise<void>}
   */
  async remove() {
    await this.#client.call(this.job.links.self, { method: "DELETE" });
  }
}

/** One daemon. */
export class Penumbra {
  /**
   * @param {string | URL} server Where it is, with the path it is offered under; left out: where
   *   this module comes from.
   * @param {{token?: string, retries?: number, fetch?: typeof fetch}} options `token`: bearer
   *   token. `retries`: how often a request is sent again that was refused for now (429, 503) or
   *   that found nobody; Retry-After is honoured. `fetch`: in place of the global one.
   */
  constructor(server = new URL(".", import.meta.url), { token = "", retries = 4, fetch } = {}) {
    const base = new URL(server, globalThis.document?.baseURI);
    if (!base.pathname.endsWith("/")) base.pathname += "/";
    base.search = base.hash = "";
    this.server = base;
    this.token = token;
    this.retries = retries;
    this.fetch = fetch ?? ((...given) => globalThis.fetch(...given));
  }

  /**
   * Any call; throws PenumbraError where the answer is an error, and the signal's reason.
   * @param {string} path Such as "v1/scenes", or a link from an answer.
   * @param {RequestInit} init
   * @returns {Promise<Response>}
   */
  async call(path, init = {}) {
    const headers = new Headers(init.headers);
    if (this.token) headers.set("Authorization", "Bearer " + this.token);
    for (let tried = 0; ; tried++) {
      /** @type {PenumbraError} */
      let failure;
      try {
        const answer = await this.fetch(new URL(path, this.server), { ...init, headers });
        if (answer.ok) return answer;
        failure = await readProblem(answer);
      } catch (reason) {
        if (init.signal?.aborted) throw init.signal.reason;
        const { cause, message } = /** @type {any} */ (reason);
        failure = new PenumbraError({ title: "The service does not answer.", status: 0,
          detail: "The service does not answer (" + (cause?.code ?? message) + ").", retryable: true });
      }
      const later = [0, 429, 503].includes(failure.status) && failure.retryable;
      if (!later || tried >= this.retries) throw failure;
      await pause(failure.retryAfterMs ?? backoffMs(tried), init.signal);
    }
  }

  /**
   * @param {string} path
   * @param {RequestInit} init
   * @returns {Promise<any>}
   */
  async json(path, init = {}) {
    return (await this.call(path, init)).json();
  }

  /** @returns {Promise<any>} */
  #send(/** @type {string} */ path, /** @type {any} */ body, /** @type {Options} */ { signal } = {},
    headers = {}) {
    return this.call(path, { method: "POST", body: JSON.stringify(body), signal,
      headers: { "Content-Type": "application/json", ...headers } });
  }

  /** Version, device, limits.
   * @param {Options} options
   * @returns {Promise<Service>} */
  service({ signal } = {}) {
    return this.json("v1", { signal });
  }

  /** Rolling timings per method and stage.
   * @param {Options} options
   * @returns {Promise<Stats>} */
  stats({ signal } = {}) {
    return this.json("v1/stats", { signal });
  }

  /** Every shadow method with its parameters.
   * @param {Options} options
   * @returns {Promise<TechniqueInfo[]>} */
  async techniques({ signal } = {}) {
    return (await this.json("v1/techniques", { signal })).techniques;
  }

  /** The stored scenes, asked for page by page.
   * @param {Options & {name?: string, tag?: string}} options `name`: only those whose name has it
   *   in it, whatever its case; `tag`: only those that have it.
   * @returns {AsyncGenerator<Scene>} */
  async *scenes({ signal, name, tag } = {}) {
    for (let path = "v1/scenes" + queryOf({ limit: "100", name, tag }); path;) {
      const page = await this.json(path, { signal });
      yield* page.scenes;
      path = page.next;
    }
  }

  /**
   * What a scene holds.
   * @param {string} id Here and wherever an id is taken: all of it, or at least six of its first
   *   digits that no other begins with.
   * @param {Options} options
   * @returns {Promise<Scene>}
   */
  scene(id, { signal } = {}) {
    return this.json("v1/scenes/" + id, { signal });
  }

  /**
   * Changes what a scene is called.
   * @param {string} id
   * @param {SceneChanges} changes `name`, `tags`; null: it has none any more.
   * @param {Options} options
   * @returns {Promise<Scene>}
   */
  changeScene(id, changes, { signal } = {}) {
    return this.json("v1/scenes/" + id, { method: "PATCH", signal, body: JSON.stringify(changes),
      headers: { "Content-Type": "application/json" } });
  }

  /**
   * A small picture of a scene (JPEG), which the service makes once and keeps.
   * @param {string} id
   * @param {Options} options
   * @returns {Promise<Picture>}
   */
  async thumbnail(id, { signal } = {}) {
    const answer = await this.call("v1/scenes/" + id + "/thumbnail", { signal });
    return new Picture(await answer.blob(), answer.headers);
  }

  /**
   * @param {string} id
   * @returns {Promise<void>}
   */
  async removeScene(id) {
    await this.call("v1/scenes/" + id, { method: "DELETE" });
  }

  /**
   * Stores a scene; the same bytes again give the same id.
   * @param {Bytes | Iterable<File>} data A .glb or zip; or the files of a .gltf, by their names, or
   *   by their paths where a folder was chosen or dropped.
   * @param {Options & {entry?: string, name?: string}} options `entry`: the scene that is wanted
   *   of several. `name`: what it is to be called; else as its file.
   * @returns {Promise<Scene>}
   */
  upload(data, { signal, entry, name } = {}) {
    const path = "v1/scenes" + queryOf({ entry, name: name || entry || nameOf(data) });
    return this.json(path, { method: "POST", signal, ...uploadBody(data) });
  }

  /** Stores an emission image for lights.
   * @param {Bytes} data PNG, JPEG or WebP.
   * @param {Options} options
   * @returns {Promise<ImageInfo>} */
  uploadImage(data, { signal } = {}) {
    return this.json("v1/images", { method: "POST", signal, ...uploadBody(data) });
  }

  /**
   * @param {string} scene Id.
   * @param {RenderRequest} request
   * @param {Options} options
   * @returns {Promise<Picture>}
   */
  async render(scene, request = {}, { signal } = {}) {
    const answer = await this.#send("v1/scenes/" + scene + "/render", request, { signal });
    return new Picture(await answer.blob(), answer.headers);
  }

  /**
   * The full record of a render: the request as completed, warnings, times of every pass, and a
   * link to the image that holds as long as it is kept.
   * @param {string} scene Id.
   * @param {RenderRequest} request
   * @param {Options} options
   * @returns {Promise<RenderRecord>}
   */
  async record(scene, request = {}, { signal } = {}) {
    return (await this.#send("v1/scenes/" + scene + "/render", request, { signal },
      { Accept: "application/json" })).json();
  }

  /**
   * The same picture as it gets better; the last one, `done`, is the plain answer. Leaving the loop
   * or aborting ends the render.
   * @param {string} scene Id.
   * @param {RenderRequest} request
   * @param {Options} options
   * @returns {AsyncGenerator<{record: RenderRecord, picture: Picture, done: boolean}>}
   */
  async *refine(scene, request = {}, { signal } = {}) {
    for await (const { event, data } of this.#follow(scene, "render", request, signal)) {
      if (event !== "picture" && event !== "done") continue;
      const done = event === "done";
      let picture;
      if (data.image.href)
        try {
          const image = await this.call(data.image.href, { signal });
          picture = new Picture(await image.blob(), image.headers);
        } catch (failure) { // a better one has taken its place
          if (!(failure instanceof PenumbraError && failure.status === 404)) throw failure;
        }
      if (done) picture ??= await this.render(scene, request, { signal }); // was not kept
      if (picture) yield { record: data, done, picture };
    }
  }

  /** The events of an answer that ends with `done`.
   * @returns {AsyncGenerator<ServerEvent>} */
  async *#follow(/** @type {string} */ scene, /** @type {string} */ what, /** @type {any} */ request,
    /** @type {AbortSignal | undefined} */ signal) {
    const leaving = new AbortController();
    const both = anySignal(signal, leaving.signal);
    try {
      const answer = await this.#send("v1/scenes/" + scene + "/" + what, request, { signal: both },
        { Accept: "text/event-stream" });
      for await (const event of readEvents(answer.body)) {
        if (event.event === "problem") throw new PenumbraError(event.data);
        yield event;
        if (event.event === "done") return;
      }
      throw broken("");
    } catch (reason) {
      if (signal?.aborted) throw signal.reason;
      if (!(reason instanceof TypeError)) throw reason;
      throw broken(reason.message);
    } finally {
      leaving.abort();
    }
  }

  /**
   * How far methods are from a reference, and what they cost.
   * @param {string} scene Id.
   * @param {CompareRequest} request
   * @param {Options} options
   * @returns {Promise<Comparison>}
   */
  async compare(scene, request, { signal } = {}) {
    return (await this.#send("v1/scenes/" + scene + "/compare", request, { signal })).json();
  }

  /**
   * The same as it is measured: "reference" and each "method", whose data is its entry of the
   * comparison, and at the end "done", whose data is the comparison. Leaving the loop or aborting
   * ends it.
   * @param {string} scene Id.
   * @param {CompareRequest} request
   * @param {Options} options
   * @returns {AsyncGenerator<ServerEvent>}
   */
  measure(scene, request, { signal } = {}) {
    return this.#follow(scene, "compare", request, signal);
  }

  /**
   * Starts a job: of a sequence, or of what `render` and `compare` would answer.
   * @param {"sequence" | "render" | "compare"} kind
   * @param {string} scene Id.
   * @param {Record<string, any>} request Of a sequence with its `sequence`.
   * @param {Options & {key?: string}} options `key`: the same request sent with it again makes no
   *   second job; made up where there is none, so that a retry makes one job.
   * @returns {Promise<JobHandle>}
   */
  async start(kind, scene, request = {}, { signal, key = "" } = {}) {
    const sequence = kind === "sequence";
    const answer = await this.#send(sequence ? "v1/jobs" : "v1/scenes/" + scene + "/" + kind,
      sequence ? { scene, ...request } : request, { signal },
      { "Idempotency-Key": key || await makeKey(),
        ...(sequence ? {} : { Prefer: "respond-async" }) });
    return new JobHandle(this, await answer.json());
  }

  /** A job that was started before.
   * @param {string} id
   * @param {Options} options
   * @returns {Promise<JobHandle>} */
  async job(id, { signal } = {}) {
    return new JobHandle(this, await this.json("v1/jobs/" + id, { signal }));
  }

  /**
   * The caller's jobs, from the newest on, asked for page by page.
   * @param {Options} options
   * @returns {AsyncGenerator<Job>}
   */
  async *jobs({ signal } = {}) {
    for (let path = "v1/jobs?limit=100"; path;) {
      const page = await this.json(path, { signal });
      yield* page.jobs;
      path = page.next;
    }
  }

  /**
   * What the service counts, once a second, until the signal is aborted or the loop is left; it
   * comes back when the service does.
   * @param {Options} options
   * @returns {AsyncGenerator<any>}
   */
  async *events({ signal } = {}) {
    for await (const event of this.listen("v1/events", { signal, forever: true })) yield event.data;
  }

  /**
   * Server-sent events that go on, behind the last one, where a connection broke off.
   * @param {string} path
   * @param {Options & {after?: string, forever?: boolean}} options `forever`: the stream's
   *   end is no end, and a service that is away is waited for.
   * @returns {AsyncGenerator<ServerEvent>}
   */
  async *listen(path, { signal, after = "", forever = false } = {}) {
    const leaving = new AbortController();
    const both = anySignal(signal, leaving.signal);
    try {
      for (let tried = 0; ; tried++) {
        let ended = false;
        try {
          const answer = await this.call(path, { signal: both, headers: {
            Accept: "text/event-stream", ...(after ? { "Last-Event-ID": after } : {}) } });
          if (answer.status === 204) return; // nothing is left to tell
          for await (const event of readEvents(answer.body)) {
            tried = 0;
            after = event.id || after;
            yield event;
          }
          ended = true;
        } catch (reason) {
          if (both.aborted) throw both.reason;
          const passing = reason instanceof PenumbraError ? reason.retryable :
            reason instanceof TypeError; // fetch's word for a broken connection
          if (!passing || (!forever && tried >= this.retries)) throw reason;
        }
        await pause(ended && !forever ? 0 : backoffMs(tried), both);
      }
    } finally {
      leaving.abort();
    }
  }
}

/* ---- parts ---- */

/** @returns {Record<string, number>} */
function parseTimings(/** @type {string | null} */ header) {
  return Object.fromEntries([...(header ?? "").matchAll(/([\w-]+);dur=([\d.]+)/g)]
    .map(([, name, ms]) => [name, Number(ms)]));
}

const broken = (/** @type {string} */ why) => new PenumbraError({ status: 0, retryable: true,
  title: "The answer broke off" + (why && ": " + why) + "." });

async function readProblem(/** @type {Response} */ answer) {
  const problem = await answer.json().catch(() => ({}));
  const said = answer.headers.get("Retry-After");
  const seconds = Number(said ?? NaN);
  const ms = said === null ? null : Number.isFinite(seconds) ? 1000 * seconds :
    Math.max(0, Date.parse(said) - Date.now()) || null;
  return new PenumbraError({ title: answer.statusText, retryable: answer.status === 503 ||
    answer.status === 429, ...problem, status: answer.status }, ms);
}

/** Doubled with each try, half of it by chance, so that clients do not come back together. */
function backoffMs(/** @type {number} */ tried) {
  return Math.min(250 * 2 ** tried, 8000) * (0.5 + Math.random() / 2);
}

/** @returns {Promise<void>} */
function pause(/** @type {number} */ ms, /** @type {AbortSignal | null | undefined} */ signal) {
  return new Promise((resolve, reject) => {
    if (signal?.aborted) return reject(signal.reason);
    const timer = setTimeout(() => { signal?.removeEventListener("abort", stop); resolve(); }, ms);
    const stop = () => { clearTimeout(timer); reject(signal?.reason); };
    signal?.addEventListener("abort", stop, { once: true });
  });
}

/** AbortSignal.any is not in Node 18. */
function anySignal(/** @type {(AbortSignal | undefined)[]} */ ...signals) {
  const controller = new AbortController();
  for (const signal of signals) {
    if (signal?.aborted) controller.abort(signal.reason);
    signal?.addEventListener("abort", () => controller.abort(signal.reason),
      { once: true, signal: controller.signal });
  }
  return controller.signal;
}

/** @returns {string} "?" and those that have a value, or "". */
function queryOf(/** @type {Record<string, string | undefined>} */ keys) {
  const given = Object.entries(keys).filter(([, value]) => value);
  const query = new URLSearchParams(/** @type {[string, string][]} */ (given));
  return given.length ? "?" + query : "";
}

/** @returns {string | undefined} What the file is called that the scene is. */
function nameOf(/** @type {Bytes | Iterable<File>} */ data) {
  if (Symbol.iterator in Object(data) && !ArrayBuffer.isView(data)) {
    const files = [.../** @type {Iterable<File>} */ (data)];
    return (files.find(file => /\.gltf$/i.test(file.name)) ?? files[0])?.name;
  }
  return /** @type {File} */ (data).name;
}

async function makeKey() {
  // Node 18 has no global one.
  const node = "node:crypto", source = globalThis.crypto ?? (await import(node)).webcrypto;
  const bytes = source.getRandomValues(new Uint8Array(16));
  return [...bytes].map(byte => byte.toString(16).padStart(2, "0")).join("");
}

/** @returns {{body: any, headers?: Record<string, string>}} */
function uploadBody(/** @type {Bytes | Iterable<File>} */ data) {
  const one = data instanceof Blob || data instanceof ArrayBuffer || ArrayBuffer.isView(data);
  const files = one ? [] : [.../** @type {Iterable<File>} */ (data)];
  if (one || (files.length === 1 && !/\.gltf$/i.test(files[0].name)))
    return { body: one ? data : files[0], headers: { "Content-Type": "application/octet-stream" } };
  const form = new FormData();
  for (const file of files) form.append("files", file, file.webkitRelativePath || file.name);
  return { body: form };
}

/**
 * The events of a stream (HTML standard, section 9.2.6), data as JSON.
 * @returns {AsyncGenerator<ServerEvent>}
 */
export async function* readEvents(/** @type {ReadableStream<Uint8Array> | null} */ stream) {
  if (!stream) return;
  const reader = stream.getReader(), decoder = new TextDecoder();
  let text = "", id = "", event = "", /** @type {string[]} */ data = [];
  try {
    for (let end = false; !end;) {
      const piece = await reader.read();
      end = piece.done;
      text += end ? decoder.decode() : decoder.decode(piece.value, { stream: true });
      // A CR at the end may be the first half of CR LF.
      const lines = text.split(end ? /\r\n|\n|\r/ : /\r\n|\n|\r(?!$)/);
      text = lines.pop() ?? "";
      for (const line of lines) {
        if (!line) {
          if (data.length)
            yield { event: event || "message", id, data: JSON.parse(data.join("\n")) };
          event = "";
          data = [];
          continue;
        }
        const colon = line.indexOf(":"), name = colon < 0 ? line : line.slice(0, colon);
        const value = colon < 0 ? "" : line.slice(colon + 1).replace(/^ /, "");
        if (name === "event") event = value;
        else if (name === "data") data.push(value);
        else if (name === "id") id = value;
      }
    }
  } finally {
    reader.releaseLock();
  }
}
