// The request that gives the picture that is shown, wherever it is sent from: what the daemon chose
// for it (lights, exposure, sky) is said, and where the camera was moved to.
import { h } from "./dom.js";
import { requestOf, techniqueOf } from "./state.js";

const figures = value => Array.isArray(value) ? value.map(figures) :
  typeof value === "number" ? Number(value.toPrecision(7)) : value;

/** A camera without what the daemon would take anyway where it was not said. */
export function brief({ eye, target, up, fov_y_deg }) {
  const camera = { eye: figures(eye), target: figures(target) };
  if (JSON.stringify(up) !== "[0,1,0]") camera.up = figures(up);
  return { ...camera, fov_y_deg: figures(fov_y_deg) };
}

/** @returns {object | null} null before the first picture. */
export function shownRequest(store, api) {
  const camera = api.view?.currentCamera, shown = api.record?.request;
  if (!camera || !shown) return null;
  const { layer } = store.state;
  return { technique: techniqueOf(store.state), width: shown.width, height: shown.height,
    camera: brief(camera), lights: store.get("lights") ?? shown.lights, ...requestOf(store.state),
    sky_level: shown.sky_level, exposure_ev: shown.exposure_ev,
    ...(layer === "beauty" ? {} : { output: { layer } }) };
}

/** Renders the picture that is shown in the format that is chosen, and saves it. */
export async function download(store, api) {
  const request = shownRequest(store, api), { scene, format } = store.state;
  if (!request) return;
  const picture = await api.daemon.render(scene, { ...request, output: { ...request.output, format } });
  h("a", { href: picture.url, download: "penumbra." + format }).click();
  setTimeout(() => picture.release(), 10000);
}
