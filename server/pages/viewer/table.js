// The panels. Each module exports `mount(element, store, api)`: it fills the element, and hears of
// changes by `store.on` and `api.on`. `element.tools` is the place for buttons beside the title. What
// one panel alone needs lies beside it.
//
// region: "bar", "stage", "left", "right" or "bottom"; in "bar" and "stage" there is no title.
// sheet: in which of the phone's sheets it stands; those in "bar" and "stage" are always there.
import * as animation from "./panels/animation.js";
import * as chart from "./panels/chart.js";
import * as code from "./panels/code.js";
import * as compare from "./panels/compare.js";
import * as jobs from "./panels/jobs.js";
import * as lights from "./panels/lights.js";
import * as method from "./panels/method.js";
import * as output from "./panels/output.js";
import * as passes from "./panels/passes.js";
import * as picture from "./panels/picture.js";
import * as scene from "./panels/scene.js";
import * as scenes from "./panels/scenes.js";
import * as service from "./panels/service.js";

export const PANELS = [
  { id: "code", region: "bar", panel: code },
  { id: "picture", region: "stage", panel: picture },
  { id: "compare", region: "stage", panel: compare },
  { id: "animation", region: "stage", panel: animation },
  { id: "scenes", title: "Scenes", region: "left", sheet: "Scenes", panel: scenes },
  { id: "method", title: "Method", region: "right", sheet: "Method", panel: method },
  { id: "lights", title: "Lights", region: "right", sheet: "Lights", panel: lights },
  { id: "scene", title: "Scene", region: "right", sheet: "Scene", panel: scene },
  { id: "output", title: "Output", region: "right", sheet: "Scene", panel: output },
  { id: "chart", title: "Error against time", region: "bottom", sheet: "Chart", panel: chart },
  { id: "passes", title: "Passes", region: "bottom", sheet: "Service", panel: passes },
  { id: "service", title: "Service", region: "bottom", sheet: "Service", panel: service },
  { id: "jobs", title: "Jobs", region: "bottom", sheet: "Service", panel: jobs },
];
