/**
 * Module worker that transcodes Basis Universal textures: three.js's own worker function, in the
 * environment that it expects.
 */
import BASIS from "three/examples/jsm/libs/basis/basis_transcoder.js";
import { KTX2Loader } from "three/examples/jsm/loaders/KTX2Loader.js";

/** Static parts of three.js's loader that are missing in its types. */
type WorkerParts = Readonly<{
  BasisWorker: () => void;
  EngineFormat: object;
  EngineType: object;
  TranscoderFormat: object;
  BasisFormat: object;
}>;

const parts = KTX2Loader as unknown as WorkerParts;
Object.assign(globalThis, {
  BASIS,
  _EngineFormat: parts.EngineFormat,
  _EngineType: parts.EngineType,
  _TranscoderFormat: parts.TranscoderFormat,
  _BasisFormat: parts.BasisFormat,
});
parts.BasisWorker();
