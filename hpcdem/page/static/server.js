// Asking the server: JSON there, JSON or a specimen back.

const TYPES = { f4: Float32Array, i4: Int32Array, u1: Uint8Array };

/** What the server refused: its sentence, and whether only because something newer was asked for. */
export class Refusal extends Error {
  constructor(message, status) {
    super(message);
    this.status = status;
  }

  get superseded() { return this.status === 409; }
}

/** POST a JSON object; the response, or a Refusal with the server's sentence. */
export async function ask(name, content, signal) {
  const response = await fetch(name, {
    method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(content), signal,
  });
  if (response.ok) return response;
  let message = `HTTP ${response.status}`;
  try { message = (await response.json()).error ?? message; } catch { /* no JSON: the number must do */ }
  throw new Refusal(message, response.status);
}

/** A specimen: 4 bytes with the length of a JSON header, the header, and behind it arrays (little endian) at the
 * places that it names. */
export async function askSpecimen(request, signal) {
  const bytes = await (await ask("specimen", request, signal)).arrayBuffer();
  const length = new DataView(bytes).getUint32(0, true);
  const specimen = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
  const arrays = {};
  for (const { name, type, offset, count } of specimen.arrays) arrays[name] = new TYPES[type](bytes, 4 + length + offset, count);
  specimen.arrays = arrays;
  specimen.order = bySize(arrays.kind);
  return specimen;
}

// Grains sorted by class, so that the pen changes colour once per class.
function bySize(kind) {
  const counts = new Int32Array(257);
  for (const k of kind) counts[k + 1]++;
  for (let k = 1; k < 257; k++) counts[k] += counts[k - 1];
  const order = new Int32Array(kind.length);
  kind.forEach((k, grain) => { order[counts[k]++] = grain; });
  return order;
}
