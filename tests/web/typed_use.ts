// Uses of the JavaScript client that type-check, and mistakes that do not.
import { Penumbra, type RenderRequest, type Scene } from './penumbra.js';

const daemon = new Penumbra('http://127.0.0.1:8080', { token: 'secret', retries: 2 });
const scene: Scene = await daemon.upload(new Blob([]), { entry: 'a.gltf' });
const request: RenderRequest = {
    technique: { name: 'pcss', params: { filter_taps: 32 } }, width: 800, lights: [{ type: 'sun' }] };
const picture = await daemon.render(scene.id, request, { signal: AbortSignal.timeout(1000) });
const ms: number = picture.timings.total + picture.blob.size;
for await (const { record, done } of daemon.refine(scene.id, { technique: 'multisample' }))
    if (done) console.log(ms, record.progress.samples, record.warnings.length);
const job = await daemon.start('sequence', scene.id, { sequence: { frames: 36 } });
for await (const { event, data } of job.events()) console.log(event, data);
const { methods } = await daemon.compare(scene.id, { techniques: ['hard', 'pcss'] });
console.log(methods[0].rmse, (await job.finished()).state === 'successful');

// @ts-expect-error: no such field
await daemon.render(scene.id, { widht: 800 });
// @ts-expect-error: a number is wanted
await daemon.render(scene.id, { width: '800' });
// @ts-expect-error: no such method
await daemon.render(scene.id, { technique: 'pcsss' });
// @ts-expect-error: no such parameter
await daemon.render(scene.id, { technique: { name: 'pcss', params: { taps: 3 } } });
// @ts-expect-error: no such member
console.log(scene.nothing_like_it);
