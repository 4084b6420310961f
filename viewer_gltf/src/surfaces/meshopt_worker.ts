/** Module worker that decodes buffers of EXT_meshopt_compression. */
import { MeshoptDecoder } from "three/examples/jsm/libs/meshopt_decoder.module.js";
import type { MeshoptAnswer, MeshoptRequest } from "./meshopt_decoder";

addEventListener("message", async ({ data }: MessageEvent<MeshoptRequest>) => {
  const { id, count, stride, source, mode, filter } = data;
  let answer: MeshoptAnswer;
  try {
    await MeshoptDecoder.ready;
    const decoded = new Uint8Array(count * stride);
    MeshoptDecoder.decodeGltfBuffer(decoded, count, stride, source, mode, filter);
    answer = { id, decoded };
  } catch (error) {
    answer = { id, fault: String(error) };
  }
  postMessage(answer, { transfer: answer.decoded === undefined ? [] : [answer.decoded.buffer] });
});
