/**
 * Textures in Basis Universal, by three's loader. Its own worker is made from text, and so falls
 * under the page's policy, which the transcoder's generated functions break; a worker from a file
 * does not. Imported when the first such texture comes.
 */
import type { WebGLRenderer } from "three";
import binaryAddress from "three/examples/jsm/libs/basis/basis_transcoder.wasm?url";
import { KTX2Loader } from "three/examples/jsm/loaders/KTX2Loader.js";
import { TemporaryError } from "../bundle/errors";

/** Throws TemporaryError if the transcoder can't be fetched. */
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
  loader.transcoderPending = Promise.resolve(); // three's loader then makes none of its own
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
