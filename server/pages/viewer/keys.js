// The keyboard, and the list of it that `?` shows.
import { h } from "./dom.js";

const rows = [];
const typing = element => element?.matches?.("input:not([type=range], [type=checkbox]), select, textarea");

/**
 * Adds a key. `act(event)` may return false for "not now".
 * @param {string} key As KeyboardEvent.key; of several, "1 to 9" say, `matches` tells which.
 */
export function bindKey(key, does, act, matches = event => event.key === key) {
  rows.push({ key, does, act, matches });
}

/** What the element over the picture does itself: only listed. */
export function listKey(key, does) {
  rows.push({ key, does, matches: () => false });
}

function open() {
  const dialog = h("dialog", { class: "keys", "aria-labelledby": "keys-title", onclose: () => dialog.remove() },
    h("h2", { id: "keys-title" }, "Keyboard"),
    h("dl", {}, rows.map(({ key, does }) => [h("dt", {}, key.split(" ").map(word =>
      /^(to|and|or)$/.test(word) ? " " + word + " " : h("kbd", {}, word))), h("dd", {}, does)])),
    h("form", { method: "dialog" }, h("button", {}, "Close")));
  document.body.append(dialog);
  dialog.addEventListener("click", event => event.target === dialog && dialog.close());
  dialog.showModal();
}

export const openKeys = open;

addEventListener("keydown", event => {
  if (event.ctrlKey || event.metaKey || event.altKey || typing(event.composedPath()[0])) return;
  if (document.querySelector("dialog[open]")) return;
  for (const row of rows)
    if (row.matches(event) && row.act(event) !== false) {
      event.preventDefault();
      return;
    }
});

bindKey("?", "This list", open);
