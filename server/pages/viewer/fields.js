// Controls of a panel, one row each: name and unit on the left, the control on the right. A double
// click on the row's name, or Backspace while it is focused, returns to the default.
import { h, icon } from "./dom.js";
import { short } from "./format.js";

let last = 0;

/** A row for a control that has `value`; `take(value)` hears what the user made of it. */
function row({ label, unit = "", help = "", start, take, control, read, write }) {
  const id = control.id = "field-" + ++last;
  const name = h("label", { htmlFor: id, title: help + (start === undefined ? "" :
    (help && "\n") + "Double-click: back to " + (start === null ? "automatic" : start) + ".") },
  label, unit && h("span", { class: "unit" }, " " + unit));
  const element = h("div", { class: "field" }, name, control);
  const back = () => {
    if (start === undefined) return;
    write(start);
    mark(start);
    take(start);
  };
  const mark = value => element.classList.toggle("changed",
    start !== undefined && JSON.stringify(value) !== JSON.stringify(start));
  name.addEventListener("dblclick", event => { event.preventDefault(); back(); });
  control.addEventListener("dblclick", event => {
    if (control.type === "range") { event.preventDefault(); back(); }
  });
  /** Shows a value that came from elsewhere. */
  element.show = value => {
    mark(value);
    if (document.activeElement !== control || JSON.stringify(read()) !== JSON.stringify(value))
      write(value);
  };
  element.mark = mark;
  return element;
}

/**
 * A number. `min`, `max`: bounds; `whole`: no fractions; `empty`: what stands where null may be.
 * The arrow keys change it by a sensible step.
 */
export function numberField({ min, max, whole = false, empty, value = null, take, ...rest }) {
  const input = h("input", { type: "number", min, max, step: whole ? 1 : "any",
    placeholder: empty ?? "", inputMode: whole ? "numeric" : "decimal" });
  const read = () => input.value === "" ? null : Number(input.value);
  const write = value => { input.value = value === null ? "" : short(value); };
  const element = row({ ...rest, control: input, take, read, write });
  const use = () => {
    const value = read();
    const bad = value === null ? empty === undefined : !input.checkValidity();
    input.setAttribute("aria-invalid", bad);
    if (bad) return;
    element.mark(value);
    take(value);
  };
  input.addEventListener("change", use);
  input.addEventListener("keydown", event => {
    const up = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (!up || whole) return;
    event.preventDefault(); // a step of the browser's would be 1
    const now = read() ?? 0, size = 10 ** Math.floor(Math.log10(Math.abs(now) || max || 1) - 1);
    write(Math.min(Math.max(now + up * size * (event.shiftKey ? 10 : 1), min ?? -Infinity),
      max ?? Infinity));
    use();
  });
  element.show(value);
  return element;
}

/** A slider with its value beside it; `say(value)` is that text. */
export function sliderField({ min, max, step, value, say = short, take, ...rest }) {
  const input = h("input", { type: "range", min, max, step });
  const output = h("output");
  const read = () => Number(input.value);
  const tell = () => {
    output.textContent = say(read());
    input.setAttribute("aria-valuetext", output.textContent);
    input.style.setProperty("--at", (read() - min) / (max - min));
  };
  const element = row({ ...rest, control: input, take, read,
    write: value => { input.value = value; tell(); } });
  output.htmlFor = input.id;
  element.classList.add("slider");
  element.append(output);
  input.addEventListener("input", () => { tell(); element.mark(read()); take(read()); });
  element.show(value);
  tell();
  return element;
}

/** One of `choices`: texts, or [value, text]. */
export function choiceField({ choices, value, take, ...rest }) {
  const select = h("select");
  const element = row({ ...rest, control: select, take, read: () => select.value,
    write: value => { select.value = value; } });
  /** Other choices than at first. */
  element.offer = choices => select.replaceChildren(...choices.map(choice =>
    Array.isArray(choice) ? new Option(choice[1], choice[0]) : new Option(choice, choice)));
  element.offer(choices);
  select.addEventListener("change", () => { element.mark(select.value); take(select.value); });
  element.show(value);
  return element;
}

/** On or off. */
export function switchField({ value, take, ...rest }) {
  const input = h("input", { type: "checkbox", role: "switch" });
  const element = row({ ...rest, control: input, take, read: () => input.checked,
    write: value => { input.checked = value; } });
  input.addEventListener("change", () => { element.mark(input.checked); take(input.checked); });
  element.show(value);
  return element;
}

/** A colour, as "#rrggbb". */
export function colorField({ value, take, ...rest }) {
  const input = h("input", { type: "color" });
  const element = row({ ...rest, control: input, take, read: () => input.value,
    write: value => { input.value = value; } });
  input.addEventListener("input", () => { element.mark(input.value); take(input.value); });
  element.show(value);
  return element;
}

/** A text of several numbers, separated by commas, or any text. */
export function textField({ components = 1, value, take, ...rest }) {
  const input = h("input", { type: "text", spellcheck: false });
  const read = () => components > 1 ? input.value.split(",").map(Number) : input.value;
  const element = row({ ...rest, control: input, take, read, write: value => {
    input.value = Array.isArray(value) ? value.map(short).join(", ") : value;
  } });
  input.addEventListener("change", () => {
    const value = read();
    const bad = components > 1 && (value.length !== components || !value.every(Number.isFinite));
    input.setAttribute("aria-invalid", bad);
    if (bad) return;
    element.mark(value);
    take(value);
  });
  element.show(value);
  return element;
}

/** A field for a row of /v1/techniques' parameters. */
export function paramField(param, value, take) {
  const common = { label: param.name.replaceAll("_", " "), unit: param.unit, help: param.help,
    start: param.default, value, take };
  if (param.choices) return choiceField({ ...common, choices: param.choices });
  if (param.type === "flag") return switchField(common);
  if (param.type === "text" || param.components > 1)
    return textField({ ...common, components: param.components });
  return numberField({ ...common, min: param.min, max: param.max, whole: param.type !== "float" });
}

/** A button with an icon, for tools; its label is what screen readers and the tip say. */
export function toolButton(label, path, onclick, props = {}) {
  return h("button", { class: "tool", type: "button", title: label, "aria-label": label, onclick,
    ...props }, icon(path));
}
