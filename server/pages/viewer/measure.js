// Measures all methods on what is shown, by the daemon's comparison.
import { VIEW_KEYS } from "./state.js";

const AREA = 400 * 300; // px, of what is measured when no size was asked for
const DEADLINE_MS = 10 * 60 * 1000;
const COMPARED = ["camera", "lights", "ground", "ground_albedo", "sky", "sky_level", "sky_intensity",
  "ambient", "background", "exposure_ev", "tone_map", "antialias", "edges", "casters", "classify",
  "time_s", "animation", "variant"];

/** What of the state the figures hold for. */
export const viewOf = state => JSON.stringify(VIEW_KEYS.map(key => state[key])
  .concat(state.width, state.height));

/**
 * The comparison of what a record shows: the same camera, lights and exposure, whatever the daemon
 * had chosen.
 * @param {object} record Of the picture that is shown.
 * @param {{width: number | null, height: number | null}} wanted
 */
export function compareRequest(record, { width, height }) {
  const shown = record.request, request = { deadline_ms: DEADLINE_MS };
  for (const key of COMPARED) if (shown[key] !== undefined && shown[key] !== null) request[key] = shown[key];
  const shrink = Math.min(1, Math.sqrt(AREA / (shown.width * shown.height)));
  request.width = width ?? Math.max(11, Math.round(shown.width * shrink));
  request.height = height ?? Math.max(11, Math.round(shown.height * shrink));
  return request;
}

/** How a method is called in short: its name, and what is not at its default. */
export function shortName({ name, params }, info) {
  const changed = Object.entries(params ?? {}).filter(([key, value]) => {
    const param = info?.params.find(param => param.name === key);
    return param && JSON.stringify(param.default) !== JSON.stringify(value);
  });
  return name + changed.map(([key, value]) => " " + key + "=" + value).join("");
}
