/**
 * Puts the two eyes' pictures on the canvas so that the lenses make them straight: a grid over each
 * picture, its vertices moved by the lens's inverse. The distortion is evaluated once for each
 * vertex of a layout, not for each pixel of a frame; between them it is linear, which with 40 cells
 * a side is off by at most 0.42 pixels of a phone 2532 pixels wide (Cardboard v2; v1 0.23).
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

const CELLS = 40;
const SIDES: readonly Side[] = ["left", "right"];
/** Length of the line between the eyes, as a share of the height: it aligns phone and viewer. */
const LINE_HEIGHT = 0.15;
const LINE_COLOR = 0x606060;

export class DistortionPass {
  private readonly scene = new Scene();
  private readonly camera = new Camera();
  private readonly mesh: Mesh<BufferGeometry, ShaderMaterial>;
  private readonly kept = new Color();

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
    this.mesh.frustumCulled = false; // its positions are those of the screen already
    this.scene.background = new Color(0);
    this.scene.add(this.mesh);
  }

  setLens(profile: Profile, screen: Screen): void {
    this.mesh.geometry.dispose();
    this.mesh.geometry = meshOf(profile, screen);
  }

  /** @param eyes left eye in the left half, right eye in the right */
  render(renderer: WebGLRenderer, eyes: WebGLRenderTarget): void {
    this.mesh.material.uniforms.uEyes.value = eyes.texture;
    renderer.setRenderTarget(null);
    renderer.render(this.scene, this.camera);
    this.drawLine(renderer);
  }

  private drawLine(renderer: WebGLRenderer): void {
    const { width, height } = renderer.domElement;
    const ratio = renderer.getPixelRatio(); // three's rectangles are in CSS pixels
    const thickness = Math.max(2, Math.round(ratio));
    renderer.getClearColor(this.kept);
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
    renderer.setClearColor(this.kept, alpha);
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
  const pictures: number[] = [];
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
        pictures.push(u, v);
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
  geometry.setAttribute("aPicture", new Float32BufferAttribute(pictures, 2));
  geometry.setIndex(indices);
  return geometry;
}
