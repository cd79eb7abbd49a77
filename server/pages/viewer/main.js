// The viewer: a state, a daemon, and panels that show and change them.
import { Api } from "./api.js";
import { layOut } from "./layout.js";
import { Store } from "./state.js";
import { PANELS } from "./table.js";

const store = new Store(), api = new Api();
layOut(PANELS, store, api);

/** The first scene, where none or one that is not there any more was asked for. */
async function choose() {
  const { scene } = store.state;
  if (api.scenes.some(({ id }) => id === scene) || (scene && api.scenes.length)) return;
  if (api.scenes.length) store.set({ scene: api.scenes[0].id });
}

api.on("scenes", () => choose());
store.on(["scene"], ({ scene }) => scene && api.guard(() => api.loadScene(scene))());
api.guard(() => api.load())();
api.watch();
