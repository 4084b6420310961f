/**
 * Loads Basis Universal textures with three.js's loader. Its own worker is made from text, so the
 * page's content policy applies to it, and the transcoder's generated functions violate the policy.
 * A worker from a file avoids this. Imported when the first such texture is loaded.
 */
import type { WebGLRenderer } from "three";
import binaryAddress from "three/examples/jsm/libs/basis/basis_transcoder.wasm?url";
import { KTX2Loader } from "three/examples/jsm/loaders/KTX2Loader.js";
import { TemporaryError } from "../bundle/errors";

/** Makes the loader. Throws TemporaryError if the transcoder can't be fetched. */
export async function makeTextureLoader(renderer: WebGLRenderer): Promise<KTX2Loader> {
  const loader = new KTX2Loader().detectSupport(renderer);
  const binary = await fetchTranscoder();
  loader.workerPool.setWorkerCreator(() => {
    const worker = new Worker(new URL("./basis_worker.ts", import.meta.url), { type: "module" });
    const transcoderBinary = binary.slice(0);
    const message = { type: "init", config: loader.workerConfig, transcoderBinary };
    worker.postMessage(message, [transcoderBinary]);
    return worker;
  });
  loader.transcoderBinary = binary;
  // The transcoder counts as loaded, so three.js's loader does not load its own one.
  loader.transcoderPending = Promise.resolve();
  return loader;
}

async function fetchTranscoder(): Promise<ArrayBuffer> {
  try {
    const response = await fetch(binaryAddress);
    if (!response.ok) throw new Error(`the host answered ${response.status}`);
    return await response.arrayBuffer();
  } catch (error) {
    throw new TemporaryError(`the texture decoder can't be fetched: ${String(error)}`, {
      cause: error,
    });
  }
}
