/**
 * Draws both eyes' images on the canvas, distorted so that the lenses make them straight again.
 * A grid lies over each image, and its vertices are moved by the inverse of the lens's distortion.
 * The grid is computed once for each layout. Between vertices the distortion is taken as linear:
 * with 40 cells a side the error is at most 0.42 pixels on a phone 2532 pixels wide (Cardboard v2;
 * v1 0.23).
 */
import {
  BufferGeometry,
  Camera,
  Color,
  Float32BufferAttribute,
  GLSL3,
  Mesh,
  Scene,
  ShaderMaterial,
  type WebGLRenderer,
  type WebGLRenderTarget,
} from "three";
import fragment from "./distortion.frag.glsl?raw";
import vertex from "./distortion.vert.glsl?raw";
import { eyeTangents, type Screen, type Side, toScreen } from "./lens";
import type { Profile } from "./viewer_profile";

/** Cells of the grid along each side of an eye's image. */
const CELLS = 40;
const SIDES: readonly Side[] = ["left", "right"];
/** Length of the line between the eyes, as a share of the height. Users align the phone by it. */
const LINE_HEIGHT = 0.15;
const LINE_COLOR = 0x606060;

export class DistortionPass {
  private readonly scene = new Scene();
  private readonly camera = new Camera();
  private readonly mesh: Mesh<BufferGeometry, ShaderMaterial>;
  private readonly clearColor = new Color();

  constructor() {
    const material = new ShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: vertex,
      fragmentShader: fragment,
      uniforms: { uEyes: { value: null } },
      depthTest: false,
      depthWrite: false,
    });
    this.mesh = new Mesh(new BufferGeometry(), material);
    this.mesh.frustumCulled = false; // the positions are already in clip space
    this.scene.background = new Color(0);
    this.scene.add(this.mesh);
  }

  /** Computes the grid for other lenses or another screen. */
  setLens(profile: Profile, screen: Screen): void {
    this.mesh.geometry.dispose();
    this.mesh.geometry = meshOf(profile, screen);
  }

  /** @param eyes image of the left eye in the left half, of the right eye in the right half */
  render(renderer: WebGLRenderer, eyes: WebGLRenderTarget): void {
    this.mesh.material.uniforms.uEyes.value = eyes.texture;
    renderer.setRenderTarget(null);
    renderer.render(this.scene, this.camera);
    this.drawLine(renderer);
  }

  private drawLine(renderer: WebGLRenderer): void {
    const { width, height } = renderer.domElement;
    const ratio = renderer.getPixelRatio(); // three.js's rectangles are in CSS pixels
    const thickness = Math.max(2, Math.round(ratio));
    renderer.getClearColor(this.clearColor);
    const alpha = renderer.getClearAlpha();
    renderer.setScissor(
      (Math.floor(width / 2) - thickness / 2) / ratio,
      0,
      thickness / ratio,
      (LINE_HEIGHT * height) / ratio,
    );
    renderer.setScissorTest(true);
    renderer.setClearColor(LINE_COLOR, 1);
    renderer.clear(true, false, false);
    renderer.setClearColor(this.clearColor, alpha);
    renderer.setScissorTest(false);
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}

function meshOf(profile: Profile, screen: Screen): BufferGeometry {
  const positions: number[] = [];
  const uvs: number[] = [];
  const images: number[] = [];
  const indices: number[] = [];
  SIDES.forEach((side, eye) => {
    const { left, right, bottom, top } = eyeTangents(profile, screen, side);
    const first = positions.length / 3;
    for (let row = 0; row <= CELLS; row++) {
      for (let column = 0; column <= CELLS; column++) {
        const u = column / CELLS;
        const v = row / CELLS;
        const x = u * (left + right) - left;
        const y = v * (bottom + top) - bottom;
        const [across, along] = toScreen(profile, screen, side, x, y);
        positions.push(2 * across - 1, 2 * along - 1, 0);
        uvs.push((eye + u) / 2, v);
        images.push(u, v);
        if (row === CELLS || column === CELLS) continue;
        const at = first + row * (CELLS + 1) + column;
        const above = at + CELLS + 1;
        indices.push(at, at + 1, above, above, at + 1, above + 1);
      }
    }
  });
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(positions, 3));
  geometry.setAttribute("uv", new Float32BufferAttribute(uvs, 2));
  geometry.setAttribute("aImage", new Float32BufferAttribute(images, 2));
  geometry.setIndex(indices);
  return geometry;
}
