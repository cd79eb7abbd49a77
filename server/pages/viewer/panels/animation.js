// The file's animations and their time line. The picture follows by small ones while it plays or is
// scrubbed; at rest comes the full one.
import { h, icon } from "../dom.js";
import { bindKey } from "../keys.js";

const PLAY = "M5 3.5v9l7-4.5z", PAUSE = "M5.5 3.5v9M10.5 3.5v9";
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];
const STEP_S = 1 / 24;

/** A request's word for one of a scene's animations: its name where no other has it, else its number. */
const wordOf = (animation, all) => animation.name &&
  all.filter(({ name }) => name === animation.name).length === 1 ? animation.name : String(animation.index);

export function mount(element, store, api) {
  element.hidden = true;
  element.className += " timeline";
  element.setAttribute("role", "group");
  element.setAttribute("aria-label", "Animation");
  const button = h("button", { type: "button", class: "tool", onclick: () => playing ? stop() : play() });
  const choice = h("select", { "aria-label": "Animation", onchange: () => {
    stop();
    store.set({ animation: choice.value, time_s: 0 }, { push: true });
  } });
  const line = h("input", { type: "range", min: 0, step: 0.001, "aria-label": "Time in seconds",
    oninput: () => { stop(); seek(Number(line.value)); }, ondblclick: () => { stop(); seek(0); } });
  const said = h("output", {});
  const speed = h("select", { "aria-label": "Speed", title: "Speed" }, SPEEDS.map(value =>
    h("option", { value, selected: value === 1 }, value + " ×")));
  element.append(button, choice, line, said, speed);
  let playing = 0, animations = [];

  const current = () => animations.find(animation => wordOf(animation, animations) === store.get("animation"));
  const seek = time => store.set({ time_s: Number(time.toFixed(4)) });

  function dress() {
    const name = playing ? "Pause" : "Play";
    button.replaceChildren(icon(playing ? PAUSE : PLAY));
    button.setAttribute("aria-label", name);
    button.title = name + " (space)";
  }

  function play() {
    if (!current()) store.set({ animation: wordOf(animations[0], animations), time_s: 0 }, { push: true });
    const { duration_s } = current();
    let before = performance.now();
    const step = now => {
      if (!playing) return;
      const time = store.get("time_s") + (now - before) / 1000 * Number(speed.value);
      before = now;
      if (duration_s > 0) seek(Math.max(time, 0) % duration_s);
      playing = requestAnimationFrame(step);
    };
    playing = requestAnimationFrame(step);
    dress();
  }

  function stop() {
    cancelAnimationFrame(playing);
    playing = 0;
    dress();
  }

  function show() {
    const animation = current(), { time_s } = store.state, length = animation?.duration_s ?? 0;
    choice.value = animation ? store.get("animation") : "";
    line.disabled = !animation;
    line.max = length;
    line.value = Math.min(time_s, length);
    line.style.setProperty("--at", length ? line.value / length : 0);
    said.textContent = animation ? time_s.toFixed(2) + " / " + length.toFixed(2) + " s" : "";
    line.setAttribute("aria-valuetext", said.textContent);
  }

  function fill(scene) {
    const next = scene?.animations ?? [];
    if (JSON.stringify(next) === JSON.stringify(animations)) return;
    stop();
    animations = next;
    element.hidden = !animations.length;
    choice.replaceChildren(new Option("no animation", ""), ...animations.map(animation =>
      new Option(animation.name || "animation " + animation.index, wordOf(animation, animations))));
    show();
  }

  dress();
  api.on("scene", fill);
  store.on(["animation", "time_s", "scene"], (state, changed) => {
    if (changed.has("scene")) stop();
    show();
  });
  bindKey("Space", "Play the animation, or pause", event => {
    if (!animations.length || event.target.closest?.("button, summary, a, input")) return false;
    if (playing) stop();
    else play();
  }, event => event.key === " ");
  bindKey(", .", "A 24th of a second back and forth", event => {
    if (!current()) return false;
    stop();
    const { duration_s } = current();
    seek(Math.min(Math.max(store.get("time_s") + (event.key === "." ? STEP_S : -STEP_S), 0), duration_s));
  }, event => event.key === "," || event.key === ".");
}
