// Handles of the lights over the picture: dragged, or moved by the arrow keys. A light that is
// outside of the picture has its handle on the border.
import { announce, h, svg } from "../dom.js";
import { Lens, add, minus, times } from "../lens.js";
import { place, round, shape, sized, toHex } from "./rig.js";

const INSET = 18; // px, of handles on the border
const STEP = 12; // px that an arrow key moves
const KINDS = { move: "position", aim: "target", size: "size" };
const KEYS = "Drag, or use the arrow keys; with Shift, towards what it lights or away.";

/** Draws the lights of a rig over the view; returns what shows or hides them. */
export function addGizmos(rig, api) {
  const drawing = svg("svg", { class: "lines", "aria-hidden": "true" });
  const hints = h("p", { class: "unseen", id: "gizmo-keys" }, KEYS);
  const box = h("div", { class: "gizmos", role: "group", "aria-label": "Lights on the picture" },
    drawing, hints);
  api.overlay.append(box);
  const handles = new Map(); // by kind and number
  let lens = null, due = false;

  function look() {
    const camera = api.view.currentCamera, { clientWidth: width, clientHeight: height } = api.view;
    const picture = api.record?.image ?? { width, height };
    lens = camera && width && height ? new Lens(camera, { width, height }, picture) : null;
    if (!lens || box.hidden) return;
    drawing.setAttribute("viewBox", "0 0 " + width + " " + height);
    const lines = [], kept = new Set();
    rig.lights.forEach((light, number) => {
      const chosen = number === rig.selected;
      if (chosen) lines.push(...linesOf(light));
      put("move", number, place(light, rig.reach), kept, light);
      if (!chosen) return;
      if (light.type !== "point") put("aim", number, light.target, kept, light);
      const { size } = shape(light, rig.reach, lens);
      if (size) put("size", number, size, kept, light);
    });
    for (const [key, handle] of handles)
      if (!kept.has(key)) {
        if (document.activeElement === handle) handles.get("move " + rig.selected)?.focus();
        handle.remove();
        handles.delete(key);
      }
    drawing.replaceChildren(...lines);
  }

  function linesOf(light) {
    const at = place(light, rig.reach), { outline, apex } = shape(light, rig.reach, lens);
    const seen = outline.map(point => lens.project(point)), whole = seen.every(Boolean);
    const path = points => points.map(point => point.map(v => v.toFixed(1)).join(",")).join(" ");
    const made = [];
    const stroke = (points, kind, tag = "polyline") => made.push(
      svg(tag, { points: path(points), class: "under" }), svg(tag, { points: path(points), class: kind }));
    const from = lens.project(at) ?? lens.border(at, INSET), to = lens.project(light.target);
    if (light.type !== "point" && to) stroke([from, to], "axis");
    if (seen.length && whole) stroke(seen, apex ? "cone" : "emitter", "polygon");
    else // what is in front of the eye
      seen.forEach((point, i) => point && seen.at(i - 1) && stroke([seen.at(i - 1), point], "cone"));
    if (apex && lens.project(apex))
      for (const i of [0, 10, 20, 30]) if (seen[i]) stroke([lens.project(apex), seen[i]], "axis");
    return made;
  }

  /** A handle at a point of the world. */
  function put(kind, number, point, kept, light) {
    const key = kind + " " + number;
    let handle = handles.get(key);
    kept.add(key);
    if (!handle) handles.set(key, handle = box.appendChild(makeHandle(kind, number)));
    const seen = lens.project(point), inside = seen && lens.holds(seen);
    const [x, y] = inside ? seen : lens.border(point, INSET);
    handle.hidden = !inside && kind !== "move";
    handle.classList.toggle("outside", !inside);
    handle.classList.toggle("chosen", number === rig.selected);
    handle.style.translate = x + "px " + y + "px";
    if (kind === "move") handle.style.setProperty("--light", toHex(light.color ?? [1, 1, 1]));
    handle.setAttribute("aria-label", "Light " + (number + 1) + ", " + light.type + ": " + KINDS[kind] +
      (inside ? "" : ", outside of the picture"));
  }

  function makeHandle(kind, number) {
    const handle = h("button", { type: "button", class: "handle " + kind,
      "aria-describedby": "gizmo-keys" });
    let drag = null;
    handle.addEventListener("focus", () => number !== rig.selected && rig.select(number));
    handle.addEventListener("pointerdown", event => {
      if (event.button || !lens) return;
      event.preventDefault();
      handle.focus({ preventScroll: true });
      handle.setPointerCapture(event.pointerId);
      drag = { x: event.clientX, y: event.clientY, light: rig.lights[number], lens, moved: false };
    });
    handle.addEventListener("pointermove", event => {
      if (!drag) return;
      const [dx, dy] = [event.clientX - drag.x, event.clientY - drag.y];
      if (!drag.moved && Math.hypot(dx, dy) < 3) return;
      const push = !drag.moved;
      drag.moved = true;
      move(kind, drag.light, dx, dy, event.shiftKey, drag.lens, { push });
    });
    for (const end of ["pointerup", "pointercancel"])
      handle.addEventListener(end, () => { drag = null; });
    handle.addEventListener("keydown", event => {
      const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
      if (!arrow || !lens || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      event.stopPropagation();
      move(kind, rig.lights[number], STEP * arrow[0], STEP * arrow[1], event.shiftKey, lens);
      announce(KINDS[kind] + " " + told(kind, rig.light));
    });
    return handle;
  }

  /** Moves what a handle stands for by pixels from where it was. */
  function move(kind, light, dx, dy, along, eye, how) {
    const at = place(light, rig.reach);
    if (kind === "aim") return rig.change({ target: round(eye.moved(light.target, dx, dy)) }, how);
    if (kind === "move") {
      // Up the picture is away from what is lit.
      const to = along ? add(light.target, times(minus(at, light.target), 1.01 ** -dy)) :
        eye.moved(at, dx, dy);
      return rig.change({ position: round(to) }, how);
    }
    const { size, plane } = shape(light, rig.reach, eye), seen = eye.project(size);
    if (!seen) return;
    const met = eye.meet([seen[0] + dx, seen[1] + dy], ...plane);
    rig.change(sized(light, rig.reach, met ?? eye.moved(size, dx, dy)), how);
  }

  const draw = () => {
    if (due) return;
    due = true;
    requestAnimationFrame(() => { due = false; look(); });
  };
  rig.addEventListener("change", draw);
  api.view.addEventListener("camerachange", draw);
  api.on("picture", draw);
  new ResizeObserver(draw).observe(api.overlay);

  return {
    get shown() {
      return !box.hidden;
    },
    show(on) {
      box.hidden = !on;
      draw();
    },
    /** Gives the handle of the light's position the keyboard. */
    focus() {
      look();
      handles.get("move " + rig.selected)?.focus();
    },
  };
}

/** What was changed, as text. */
function told(kind, light) {
  if (kind === "move") return light.position.join(", ");
  if (kind === "aim") return light.target.join(", ");
  return (light.width ? light.width + " by " + light.height : light.radius ??
    light.angular_diameter_deg ?? light.outer_cone_deg) + "";
}
