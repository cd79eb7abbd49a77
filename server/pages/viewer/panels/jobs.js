// Jobs: started from the view, watched as they go, cancelled, kept, played.
import { announce, h } from "../dom.js";
import { toolButton } from "../fields.js";
import { bytes } from "../format.js";
import { FPS, composer } from "./composer.js";
import { SHOWABLE, play } from "./player.js";
import { JobHandle } from "../../penumbra.js";

const OVER = ["successful", "failed", "dismissed"];
const SHOWN = 20;
const ICONS = { play: "M5 3.5v9l7-4.5z", save: "M8 2v8M4.5 7 8 10.5 11.5 7M3 13h10", drop: "M4 4l8 8M12 4l-8 8" };

export function mount(element, store, api) {
  const { form, show } = composer(store, api, (...given) => start(...given));
  const list = h("ul", { class: "jobs" }), none = h("p", { class: "hint" }, "No job. + renders a sequence of this view.");
  element.tools.append(toolButton("New sequence", "M8 3v10M3 8h10", () => show()));
  document.getElementById("stage").append(form);
  element.append(none, list);
  const rows = new Map(); // by id
  const known = new Map(); // titles and rates of those that this page has started

  const start = api.guard(async (request, title, fps) => {
    const handle = await api.daemon.start("sequence", store.get("scene"), request);
    known.set(handle.id, { title, fps });
    add(handle, true);
    announce(title + " is started.");
  }, "The sequence");

  const load = api.guard(async () => {
    const { jobs } = await api.daemon.json("v1/jobs?limit=" + SHOWN);
    for (const [id, row] of rows) if (row.broken || !jobs.some(job => job.id === id)) row.gone();
    for (const job of jobs.reverse()) if (!rows.has(job.id)) add(new JobHandle(api.daemon, job));
    tell();
  });

  function tell() {
    none.hidden = rows.size > 0;
  }

  function add(handle, own = false) {
    const { id } = handle, leaving = new AbortController();
    const image = h("img", { alt: "", width: 48, height: 36 });
    const bar = h("progress", { max: 1, "aria-label": "Progress" });
    const name = h("b", {}), said = h("small", {});
    const tool = (label, path, act) => toolButton(label, path, api.guard(act));
    const playing = tool("Play", ICONS.play, () => play({ title: titleOf(handle.job), fps: known.get(id)?.fps ?? FPS,
      total: () => handle.job.frames.total, done: () => handle.job.frames.done,
      frame: number => handle.frame(number), save: (blob, number) => offer(blob, fileOf(number, blob)) }));
    const saving = tool("Download", ICONS.save, async () => {
      const { links } = handle.job;
      if (!api.token) return offerLink(new URL(links.result, api.daemon.server), fileOf());
      offer(await handle.result(), fileOf());
    });
    const ending = tool("Cancel", ICONS.drop, async () => {
      await handle.remove();
      if (OVER.includes(handle.job.state)) return row.gone();
      ending.disabled = true;
    });
    const item = h("li", { dataset: { id } }, image, h("div", {}, name, bar, said), playing, saving, ending);
    const row = { broken: false, gone() {
      leaving.abort();
      URL.revokeObjectURL(image.src);
      item.remove();
      rows.delete(id);
      tell();
    } };
    const begun = Date.now();
    rows.set(id, row);
    list.prepend(item);
    draw();
    tell();
    if (own) item.scrollIntoView({ block: "nearest" });
    if (OVER.includes(handle.job.state)) preview(0);
    else watch();

    function fileOf(number, blob) {
      const { kind } = handle.job, end = blob?.type.split("/")[1] ?? (kind === "compare" ? "json" : "zip");
      return kind + "-" + id.slice(0, 6) + (number === undefined ? "" : "-" + String(number).padStart(4, "0")) + "." + end;
    }

    function draw() {
      const { state, frames, bytes: size, error, progress, links } = handle.job;
      const over = OVER.includes(state), some = hasPictures(handle.job);
      name.textContent = titleOf(handle.job);
      item.classList.toggle("failed", state === "failed");
      bar.hidden = over;
      bar.value = progress;
      const left = frames.done > 1 && (Date.now() - begun) / frames.done * (frames.total - frames.done) / 1000;
      said.textContent = error ? error.detail || error.title : [["running", "successful"].includes(state) ? "" : state,
        frames.total > 1 && frames.done + " of " + frames.total + " frames", over && size > 0 && bytes(size),
        state === "running" && known.has(id) && left > 1 && "about " + Math.ceil(left) + " s left"]
        .filter(Boolean).join(", ");
      playing.hidden = !some || frames.total < 2;
      saving.hidden = !links.result;
      const label = over ? "Remove" : "Cancel";
      ending.title = label;
      ending.setAttribute("aria-label", label);
    }

    async function watch() {
      try {
        let pictured = 0;
        for await (const { event, data } of handle.events({ signal: leaving.signal })) {
          if (event === "frame") {
            const { done, total } = data;
            handle.job = { ...handle.job, progress: done / total, frames: { ...handle.job.frames, done, total } };
            if (Date.now() - pictured > 500) { // of a quick job not each one
              pictured = Date.now();
              preview(data.frame);
            }
          }
          draw();
        }
        handle.job = await api.daemon.json(handle.job.links.self, { signal: leaving.signal });
        draw();
        if (handle.job.state === "successful") announce(titleOf(handle.job) + " is done.");
        preview(0);
      } catch (reason) {
        if (leaving.signal.aborted) return;
        if (reason.status === 404) return row.gone();
        row.broken = true; // until the daemon is back
        item.classList.add("failed");
        said.textContent = reason.message;
      }
    }

    async function preview(number) {
      if (!hasPictures(handle.job)) return;
      const blob = await handle.frame(number).catch(() => null);
      if (!blob || !SHOWABLE.test(blob.type) || !item.isConnected) return;
      URL.revokeObjectURL(image.src);
      image.src = URL.createObjectURL(blob);
    }
  }

  function titleOf({ id, kind, scene }) {
    const name = api.scenes.find(other => other.id === scene)?.name || scene.slice(0, 8);
    return (known.get(id)?.title ?? kind[0].toUpperCase() + kind.slice(1)) + " · " + name;
  }

  api.on("service", load); // it is known, or known again
  let under;
  api.on("live", ({ metrics: { penumbra_jobs_under_way: now } }) => {
    if (under !== undefined && under !== now) load(); // also of other programs of this caller
    under = now;
  });
}

/** Of what is cancelled nothing is kept. */
const hasPictures = ({ kind, state, frames }) => frames.done > 0 && kind !== "compare" &&
  state !== "dismissed";

function offer(blob, name) {
  const url = URL.createObjectURL(blob);
  offerLink(url, name);
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}

function offerLink(url, name) {
  h("a", { href: url, download: name }).click();
}
