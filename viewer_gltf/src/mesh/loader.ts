/** The glTF loader of all tilesets: meshopt and Basis Universal decoders come with the page. */
import type { WebGLRenderer } from "three";
import { MeshoptDecoder } from "three/examples/jsm/libs/meshopt_decoder.module.js";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { KTX2Loader } from "three/examples/jsm/loaders/KTX2Loader.js";

export class SurfaceLoader {
  private readonly ktx2: KTX2Loader;
  readonly gltf = new GLTFLoader();

  constructor(renderer: WebGLRenderer) {
    // Without a transcoder path three's loader takes the files that the bundler has put beside it.
    this.ktx2 = new KTX2Loader().detectSupport(renderer);
    this.gltf.setKTX2Loader(this.ktx2);
    this.gltf.setMeshoptDecoder(MeshoptDecoder);
  }

  dispose(): void {
    this.ktx2.dispose();
  }
}
