// Plays the frames of a job as they come.
import { h, icon } from "../dom.js";
import { toolButton } from "../fields.js";

const PLAY = "M5 3.5v9l7-4.5z", PAUSE = "M5.5 3.5v9M10.5 3.5v9";
export const SHOWABLE = /^image\/(png|jpeg|webp)$/;

/**
 * A dialog that plays `total()` frames, of which `done()` are there; `frame(number)` resolves to a
 * Blob of one, `save(blob, number)` offers it as a file.
 */
export function play({ title, fps, total, done, frame, save }) {
  const pictures = new Map(); // by number: Blob and ImageBitmap, or null while it is asked for
  const canvas = h("canvas", { role: "img", "aria-label": title });
  const button = h("button", { type: "button", class: "tool", onclick: () => run(!timer) });
  const line = h("input", { type: "range", min: 0, step: 1, "aria-label": "Frame",
    oninput: () => { run(false); at = Number(line.value); show(); } });
  const said = h("output", {});
  const rate = h("select", { "aria-label": "Frames per second" }, [...new Set([6, 12, 24, 30, 60, fps])]
    .sort((a, b) => a - b).map(value => h("option", { value, selected: value === fps }, value + " /s")));
  const dialog = h("dialog", { class: "player", "aria-label": title },
    h("header", {}, h("h2", {}, title), toolButton("Save this frame", "M8 2v8M4.5 7 8 10.5 11.5 7M3 13h10",
      () => pictures.get(at) && save(pictures.get(at).blob, at)),
    toolButton("Close", "M4 4l8 8M12 4l-8 8", () => dialog.close())),
    canvas, h("div", { class: "timeline" }, button, line, said, rate));
  let at = 0, timer = 0, open = true, shown = -1;

  async function load() {
    for (let number = 0; open && number < total(); number++) {
      while (open && number >= done()) await new Promise(resolve => setTimeout(resolve, 250));
      if (!open) return;
      const blob = await frame(number).catch(() => null); // one that failed is passed over
      if (blob && SHOWABLE.test(blob.type))
        pictures.set(number, { blob, bitmap: await createImageBitmap(blob) });
      show();
    }
  }

  function show() {
    line.max = total() - 1;
    line.value = at;
    line.style.setProperty("--at", total() > 1 ? at / (total() - 1) : 0);
    said.textContent = (at + 1) + " of " + total() +
      (pictures.size < total() ? ", " + pictures.size + " here" : "");
    const picture = pictures.get(at);
    if (!picture || shown === at) return;
    const { bitmap } = picture;
    if (canvas.width !== bitmap.width || canvas.height !== bitmap.height)
      Object.assign(canvas, { width: bitmap.width, height: bitmap.height });
    canvas.getContext("2d").drawImage(bitmap, 0, 0);
    shown = at;
  }

  function run(on) {
    clearTimeout(timer);
    timer = 0;
    button.replaceChildren(icon(on ? PAUSE : PLAY));
    button.setAttribute("aria-label", on ? "Pause" : "Play");
    if (!on) return;
    timer = setTimeout(() => {
      const next = (at + 1) % total();
      if (pictures.has(next)) at = next;
      else if (pictures.has(0)) at = 0; // around, while more come
      show();
      run(true);
    }, 1000 / Number(rate.value));
  }

  dialog.addEventListener("close", () => {
    open = false;
    run(false);
    dialog.remove();
    for (const { bitmap } of pictures.values()) bitmap.close();
  });
  dialog.addEventListener("click", event => event.target === dialog && dialog.close());
  document.body.append(dialog);
  dialog.showModal();
  load();
  show();
  run(true);
}
