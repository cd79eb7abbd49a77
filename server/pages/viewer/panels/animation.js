// The file's animations and their time line.
export function mount(element, store, api) {
  element.hidden = true;
  api.on("scene", scene => { element.hidden = !scene?.animations.length; });
}
