/**
 * Runs the Khronos glTF validator on .glb files. Each file is checked as it is, and again without
 * EXT_meshopt_compression, because the validator can't read compressed data.
 *
 * stdin: JSON array of paths. stdout: JSON array of {path, problems}, in the same order.
 */

import { readFileSync } from "node:fs";
import process from "node:process";
import { json } from "node:stream/consumers";
import validator from "gltf-validator";
import { MeshoptDecoder } from "meshoptimizer";
import { bytesOf, packGlb, unpackGlb } from "./glb.mjs";

const COMPRESSION = "EXT_meshopt_compression";
const MAX_PROBLEMS = 5;

// The validator does not know KHR_texture_basisu, the extension that allows image/ktx2.
const KTX2_WARNINGS = new Set(["VALUE_NOT_IN_LIST", "IMAGE_UNRECOGNIZED_FORMAT"]);
const ERROR = 0;
const WARNING = 1;

async function validate(bytes, what) {
  const report = await validator.validateBytes(bytes, {
    format: "glb",
    writeTimestamp: false,
    maxIssues: 0,
  });
  const basisu = report.info?.extensionsUsed?.includes("KHR_texture_basisu") ?? false;
  return report.issues.messages
    .filter(({ severity }) => severity === ERROR || severity === WARNING)
    .filter(
      ({ code, pointer }) => !(basisu && KTX2_WARNINGS.has(code) && pointer.startsWith("/images/")),
    )
    .map(
      ({ code, message, pointer }) => `${what}: ${code} at ${pointer ?? "the file"}: ${message}`,
    );
}

/** Returns the same file with every bufferView uncompressed in one buffer. */
function decompress(bytes) {
  const { document, binary } = unpackGlb(bytes);
  const parts = [];
  let end = 0;
  for (const view of document.bufferViews ?? []) {
    const packed = view.extensions?.[COMPRESSION];
    let plain;
    if (packed) {
      plain = new Uint8Array(packed.count * packed.byteStride);
      const source = bytesOf(packed, binary);
      MeshoptDecoder.decodeGltfBuffer(
        plain,
        packed.count,
        packed.byteStride,
        source,
        packed.mode,
        packed.filter,
      );
      delete view.extensions;
    } else {
      plain = bytesOf(view, binary);
    }
    view.buffer = 0;
    view.byteOffset = end;
    parts.push(plain);
    end += Math.ceil(plain.length / 4) * 4;
  }
  const whole = new Uint8Array(end);
  document.bufferViews?.forEach((view, i) => {
    whole.set(parts[i], view.byteOffset);
  });
  document.buffers = [{ byteLength: end }];
  for (const list of ["extensionsUsed", "extensionsRequired"]) {
    document[list] = document[list]?.filter((name) => name !== COMPRESSION);
    if (document[list]?.length === 0) delete document[list];
  }
  return packGlb({ document, binary: whole });
}

async function check(path) {
  try {
    const bytes = new Uint8Array(readFileSync(path));
    const problems = await validate(bytes, "as written");
    if (problems.length === 0)
      problems.push(...(await validate(decompress(bytes), "decompressed")));
    return problems;
  } catch (error) {
    return [String(error.message ?? error)];
  }
}

await MeshoptDecoder.ready;
const results = [];
for (const path of await json(process.stdin)) {
  results.push({ path, problems: (await check(path)).slice(0, MAX_PROBLEMS) });
}
process.stdout.write(JSON.stringify(results));
