/** Loads additions, which a layer of the stage adds to the specimen. This code loads only for bundles with additions. */
import { type Material, Mesh, type Object3D } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { BundleError } from "../bundle/errors";
import { fetchFile } from "../bundle/fetch";
import type { FileRef } from "../bundle/generated/bundle";

const UM_PER_METRE = 1e6;

export type LoadedAdditions = Readonly<{
  /** The group of all additions, in um of the world. */
  scene: Object3D;
  /** The meshes by the ID of their addition. */
  byId: ReadonlyMap<string, Object3D>;
  /** The translucent meshes. */
  translucent: readonly Object3D[];
  dispose: () => void;
}>;

/** Loads the additions of a bundle. Throws BundleError. */
export async function loadAdditions(base: string, file: FileRef): Promise<LoadedAdditions> {
  const bytes = await fetchFile(base, file);
  const { scene } = await new GLTFLoader()
    .parseAsync(bytes.buffer as ArrayBuffer, "")
    .catch((cause) => {
      throw new BundleError(`${file.path}: the additions can't be read: ${cause}`, { cause });
    });
  scene.scale.setScalar(UM_PER_METRE);
  const byId = new Map<string, Object3D>();
  const meshes: Mesh[] = [];
  scene.traverse((object) => {
    if (typeof object.userData.addition === "string") byId.set(object.userData.addition, object);
    if (object instanceof Mesh) meshes.push(object);
  });
  const materialsOf = (mesh: Mesh): readonly Material[] => [mesh.material].flat();
  return {
    scene,
    byId,
    translucent: meshes.filter((mesh) => materialsOf(mesh).some((each) => each.transparent)),
    dispose: () => {
      for (const mesh of meshes) {
        mesh.geometry.dispose();
        for (const material of materialsOf(mesh)) material.dispose();
      }
    },
  };
}
