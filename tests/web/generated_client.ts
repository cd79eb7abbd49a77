// A client that @hey-api/openapi-ts made from /openapi.json, used: URL FILE.
import { readFileSync } from 'node:fs';
import { client } from './client/client.gen';
import { listTechniques, renderScene, uploadScene } from './client';

const [, , url, file] = process.argv;
client.setConfig({ baseUrl: url });
const techniques = await listTechniques();
const uploaded = await uploadScene({
    body: new Blob([readFileSync(file)]),
    bodySerializer: null,
    headers: { 'Content-Type': 'model/gltf-binary' },
});
if (!uploaded.data) throw new Error(JSON.stringify(uploaded.error));
const path = { id: uploaded.data.id };
const rendered = await renderScene({
    path, parseAs: 'blob', body: { technique: 'pcss', width: 160, height: 120 } });
if (!rendered.data) throw new Error(JSON.stringify(rendered.error));
const bytes = Buffer.from(await (rendered.data as Blob).arrayBuffer());
const wrong = await renderScene({ path, body: { width: -1 } });
console.log(JSON.stringify({
    techniques: techniques.data?.techniques.map(t => t.name),
    id: path.id,
    magic: bytes.toString('latin1', 0, 8),
    width: bytes.readUInt32BE(16),
    height: bytes.readUInt32BE(20),
    problem: wrong.error,
}));
