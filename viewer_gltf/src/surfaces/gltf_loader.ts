/** The glTF loader of all tilesets. A decoder is fetched when the first surface needs it. */
import type { WebGLRenderer } from "three";
import { type GLTF, GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import type { KTX2Loader } from "three/examples/jsm/loaders/KTX2Loader.js";
import type { MeshoptWorker } from "./meshopt_decoder";
import { needsOf } from "./required_decoders";

class LazyGltfLoader extends GLTFLoader {
  constructor(
    private readonly buffers: () => Promise<MeshoptWorker>,
    private readonly textures: () => Promise<KTX2Loader>,
  ) {
    super();
  }

  override parse(
    data: ArrayBuffer | string,
    path: string,
    onLoad: (gltf: GLTF) => void,
    onError?: (event: ErrorEvent) => void,
  ): void {
    // three.js types this value as an event, but it is an Error
    const fail = (error: unknown) => onError?.(error as ErrorEvent);
    this.prepare(data).then(() => super.parse(data, path, onLoad, onError), fail);
  }

  private async prepare(data: ArrayBuffer | string): Promise<void> {
    const { meshopt, basis } = needsOf(data);
    const [decoder, textures] = await Promise.all([
      meshopt ? this.buffers() : null,
      basis ? this.textures() : null,
    ]);
    // three.js's types require the whole decoder, but its loader uses only this part
    if (decoder !== null) this.setMeshoptDecoder(decoder as never);
    if (textures !== null) this.setKTX2Loader(textures);
  }
}

export class SurfaceLoader {
  readonly gltf = new LazyGltfLoader(
    () => this.buffers(),
    () => this.textures(),
  );
  private meshopt: Promise<MeshoptWorker> | null = null;
  private ktx2: Promise<KTX2Loader> | null = null;
  private isDisposed = false;

  constructor(private readonly renderer: WebGLRenderer) {}

  private buffers(): Promise<MeshoptWorker> {
    if (this.meshopt === null) {
      this.meshopt = import("./meshopt_decoder").then((module) => new module.MeshoptWorker());
      this.meshopt.catch(() => {
        this.meshopt = null; // the next surface tries again
      });
    }
    return this.meshopt;
  }

  private textures(): Promise<KTX2Loader> {
    if (this.ktx2 === null) {
      this.ktx2 = this.loadTextures();
      this.ktx2.catch(() => {
        this.ktx2 = null; // the next surface tries again
      });
    }
    return this.ktx2;
  }

  private async loadTextures(): Promise<KTX2Loader> {
    const { makeTextureLoader } = await import("./basis_loader");
    const loader = await makeTextureLoader(this.renderer);
    if (this.isDisposed) loader.dispose();
    return loader;
  }

  dispose(): void {
    this.isDisposed = true;
    void this.meshopt?.then((worker) => worker.dispose());
    this.ktx2?.then(
      (loader) => loader.dispose(),
      () => undefined, // reported to the caller that requested it
    );
  }
}
