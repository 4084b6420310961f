/**
 * Draws a scene once for both eyes, as two instances, each in its eye's half of the frame.
 *
 * So each object costs one draw call in stereo too, on any WebGL 2. Multiview would do the same,
 * but three.js supports it only when it draws straight into a headset's layer. These frames are
 * drawn in linear light and encoded at the end.
 *
 * Large opaque surfaces are drawn for one eye after the other. As instances, triangles that reach
 * into the other eye's half are shaded and then discarded, and a shader with `discard` keeps a GPU
 * from skipping hidden surfaces.
 */
import {
  ArrayCamera,
  type BufferGeometry,
  InstancedBufferGeometry,
  Line,
  Material,
  Matrix4,
  Mesh,
  type Object3D,
  PerspectiveCamera,
  ShaderMaterial,
  Sprite,
  Vector3,
  Vector4,
} from "three";
import bothEyesFragment from "./chunks/both_eyes_fragment.glsl?raw";
import bothEyesVertex from "./chunks/both_eyes_vertex.glsl?raw";
import type { Eyes } from "./eyes";
import { includeChunks } from "./glsl_include";
import { insertInto, insertionsOf } from "./insert_glsl";
import fragmentInsertions from "./insertions/both_eyes.frag.glsl?raw";
import vertexInsertions from "./insertions/both_eyes.vert.glsl?raw";

const CHUNKS = {
  "chunks/both_eyes_vertex": bothEyesVertex,
  "chunks/both_eyes_fragment": bothEyesFragment,
};
const VERTEX = insertionsOf(includeChunks(vertexInsertions, CHUNKS));
const FRAGMENT = insertionsOf(includeChunks(fragmentInsertions, CHUNKS));

/**
 * Layer of the objects that are drawn for both eyes; other cameras do not see it. WebXR uses 1 and
 * 2.
 */
const BOTH = 4;
/** Layer of the objects that are drawn for one eye after the other. */
const EACH = 5;

/**
 * Makes the uniforms that all materials which draw for both eyes share by reference. The matrices
 * `uEyeClip` transform from the space between the eyes to the clip space of the whole frame, in
 * which each eye has its part. The number `uMiddle` is where the right eye's part begins, pixels.
 */
function makeUniforms() {
  return {
    uIsForBoth: { value: false },
    uEyeClip: { value: [new Matrix4(), new Matrix4()] },
    uMiddle: { value: 0 },
  };
}
export type BothEyesUniforms = ReturnType<typeof makeUniforms>;

/** Instanced copy of each geometry, made once even if many objects share it. */
const made = new WeakMap<BufferGeometry, InstancedBufferGeometry>();

/**
 * A geometry that is drawn once for each eye. It shares the attributes of the original, and is
 * disposed with it.
 */
function forBoth(geometry: BufferGeometry): InstancedBufferGeometry {
  if (geometry instanceof InstancedBufferGeometry) return geometry;
  const found = made.get(geometry);
  if (found !== undefined) return found;
  const { attributes, index, groups, drawRange, boundingBox, boundingSphere } = geometry;
  const shared = { attributes, index, groups, drawRange, boundingBox, boundingSphere };
  const both = Object.assign(new InstancedBufferGeometry(), { ...shared, instanceCount: 1 });
  made.set(geometry, both);
  geometry.addEventListener("dispose", () => both.dispose());
  return both;
}

type Drawn = Mesh<BufferGeometry> | Line<BufferGeometry> | Sprite;

function isDrawn(object: Object3D): object is Drawn {
  return object instanceof Mesh || object instanceof Line || object instanceof Sprite;
}

export class BothEyes {
  readonly uniforms = makeUniforms();
  private readonly camera = new ArrayCamera();
  /** Camera between the eyes that sees what either eye sees. */
  private readonly between = new PerspectiveCamera();
  private readonly adopted = new WeakSet<Material>();
  private readonly forEach = new WeakSet<Object3D>();
  private isStereo = false;
  private readonly part = new Matrix4();
  private readonly point = new Vector3();
  private readonly other = new Vector3();

  constructor() {
    for (const camera of [this.camera, this.between]) {
      camera.matrixAutoUpdate = false;
      camera.matrixWorldAutoUpdate = false;
    }
  }

  /**
   * Sets whether an object is drawn for one eye after the other, before all objects that are drawn
   * for both at once.
   */
  drawForEach(object: Object3D, is: boolean): void {
    if (is) this.forEach.add(object);
    else this.forEach.delete(object);
  }

  /**
   * Makes all objects of a scene be drawn for both eyes. Call it before each frame, to include new
   * objects.
   *
   * @param isStereo whether the frame has two eyes
   */
  prepare(scene: Object3D, isStereo: boolean): void {
    scene.traverse((object) => {
      if (!isDrawn(object)) return;
      const isForEach = isStereo && this.forEach.has(object);
      object.layers.disable(0);
      object.layers.disable(isForEach ? BOTH : EACH);
      object.layers.enable(isForEach ? EACH : BOTH);
      const { material } = object;
      if (!(material instanceof Material)) throw new TypeError(`${object.name} has many materials`);
      if (!this.adopted.has(material)) {
        // The material covers the whole frame for any eye.
        if (material instanceof ShaderMaterial) return;
        this.patch(material);
        this.adopt(material);
      }
      object.geometry = forBoth(object.geometry);
    });
  }

  /** Inserts the chunks of both eyes into a material of three.js's own. */
  private patch(material: Material): void {
    const { uniforms } = this;
    material.onBeforeCompile = (shader) => {
      Object.assign(shader.uniforms, uniforms);
      shader.vertexShader = insertInto(shader.vertexShader, VERTEX);
      shader.fragmentShader = insertInto(shader.fragmentShader, FRAGMENT);
    };
  }

  /**
   * Registers a material whose shaders have the chunks of both eyes, so that it draws for the
   * current camera's eyes.
   */
  adopt(material: Material): void {
    this.adopted.add(material);
    const { uIsForBoth } = this.uniforms;
    material.onBeforeRender = (_renderer, _scene, camera, geometry) => {
      uIsForBoth.value = this.isStereo && camera === this.between;
      if (geometry instanceof InstancedBufferGeometry) {
        geometry.instanceCount = uIsForBoth.value ? 2 : 1;
      }
    };
  }

  /** One camera for all eyes of a frame; it sees only objects in `layer`. */
  cameraOf(eyes: Eyes, layer = BOTH): ArrayCamera {
    const { camera, between, uniforms } = this;
    const { all, width_px, height_px } = eyes;
    camera.layers.set(layer);
    camera.layers.enable(0); // the layer of the lights
    if (layer === BOTH) camera.layers.enable(EACH);
    between.layers.set(layer);
    camera.cameras = [];
    const [first, second] = all;
    if (first === undefined) return camera; // before a headset's first pose
    this.isStereo = second !== undefined;
    between.viewport ??= new Vector4();
    between.viewport.set(0, 0, width_px, height_px);
    between.matrixWorld.copy(first.camera.matrixWorld);
    if (second !== undefined) {
      this.point.setFromMatrixPosition(first.camera.matrixWorld);
      this.other.setFromMatrixPosition(second.camera.matrixWorld);
      between.matrixWorld.setPosition(this.point.lerp(this.other, 0.5));
    }
    for (const each of [camera, between]) {
      each.matrixWorld.copy(between.matrixWorld);
      each.matrixWorldInverse.copy(between.matrixWorld).invert();
      each.projectionMatrix.copy(first.camera.projectionMatrix);
      each.projectionMatrixInverse.copy(first.camera.projectionMatrixInverse);
    }
    for (const eye of all) eye.camera.layers.enable(EACH);
    camera.cameras.push(...all.map((eye) => eye.camera), between);
    uniforms.uMiddle.value = second?.viewport.x ?? 0;
    all.slice(0, 2).forEach(({ camera: eye, viewport: { x, y, z, w } }, i) => {
      const [right, up] = [(2 * x + z) / width_px - 1, (2 * y + w) / height_px - 1];
      this.part.makeScale(z / width_px, w / height_px, 1).setPosition(right, up, 0);
      const clip = uniforms.uEyeClip.value[i].copy(this.part);
      clip.multiply(eye.projectionMatrix).multiply(eye.matrixWorldInverse);
      clip.multiply(between.matrixWorld);
    });
    return camera;
  }
}
