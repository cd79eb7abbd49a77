// Elements, made in one expression.

const SVG = "http://www.w3.org/2000/svg";

function dress(element, props) {
  for (const [key, value] of Object.entries(props)) {
    if (value === null || value === undefined) continue;
    if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (key === "dataset" || key === "style") Object.assign(element[key], value);
    else if (key in element && !(element instanceof SVGElement)) element[key] = value;
    else if (value !== false) element.setAttribute(key, value === true ? "" : value);
  }
  return element;
}

function fill(element, children) {
  element.append(...children.flat(Infinity).filter(child => child !== null && child !== false &&
    child !== undefined));
  return element;
}

/** An HTML element with properties (or attributes where there is no such property), listeners
 * ("onclick") and children: nodes or texts; null and false are left out. */
export function h(tag, props = {}, ...children) {
  const element = dress(document.createElement(tag), props);
  return fill(element, children);
}

/** The same in SVG, attributes only. */
export function svg(tag, props = {}, ...children) {
  const element = dress(document.createElementNS(SVG, tag), props);
  return fill(element, children);
}

/** An icon of 16 x 16 from a path, drawn in the colour of the text. */
export function icon(path) {
  return svg("svg", { viewBox: "0 0 16 16", width: 16, height: 16, "aria-hidden": "true",
    class: "icon" }, svg("path", { d: path, fill: "none", stroke: "currentColor",
    "stroke-width": 1.5, "stroke-linecap": "round", "stroke-linejoin": "round" }));
}

/** Calls `action` when nothing was asked for `ms` milliseconds, with what was asked last. */
export function settle(action, ms) {
  let timer = 0;
  return (...given) => {
    clearTimeout(timer);
    timer = setTimeout(action, ms, ...given);
  };
}

let voice;
/** Has screen readers say a text, when they have said what they are at. */
export function announce(text) {
  voice ??= document.body.appendChild(h("div", { class: "unseen", role: "status" }));
  voice.textContent = text;
}
