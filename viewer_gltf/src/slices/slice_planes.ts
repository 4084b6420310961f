/** The slices in the scene: for each, a polygon within the specimen with its image, and the letters of the sides. */
import {
  BufferAttribute,
  BufferGeometry,
  CanvasTexture,
  DoubleSide,
  LinearFilter,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  Object3D,
  SRGBColorSpace,
  Vector3,
} from "three";
import { keepUnclipped } from "../gpu/unclipped_material";
import { Label } from "../marks/label";
import type { EyeView } from "../marks/style";
import { AHEAD, type Box, boxSpan } from "../math/box";
import type { ClipPlane } from "../math/clip";
import { MAX_CORNERS } from "../math/plane_box_section";
import type { Vec3 } from "../math/vec3";
import { cornerTowards } from "./slice_corner";
import { outlineOf, placeIn, type SliceFrame } from "./slice_frame";
import type { SliceImages } from "./slice_images";

const LINE = 0xffd24a;
const LETTER = "#ffd24a";
/** Border around each slice in their common texture, pixels. */
const BORDER_PX = 1;

/** All slices as one mesh, because one draw call costs about as much as drawing their few triangles. */
class Planes {
  readonly mesh: Mesh<BufferGeometry, MeshBasicMaterial>;
  /** The slices side by side. Each has a border that repeats its edge, so that filtering does not mix neighbours. */
  private readonly canvas = document.createElement("canvas");
  private readonly texture = new CanvasTexture(this.canvas);

  constructor(private readonly slices: readonly HTMLCanvasElement[]) {
    this.texture.colorSpace = SRGBColorSpace;
    this.texture.minFilter = LinearFilter;
    this.texture.generateMipmaps = false;
    const count = slices.length * MAX_CORNERS;
    const triangles = slices.flatMap((_, plane) =>
      Array.from({ length: MAX_CORNERS - 2 }, (_, i) =>
        [0, i + 1, i + 2].map((corner) => plane * MAX_CORNERS + corner),
      ),
    );
    const geometry = new BufferGeometry()
      .setAttribute("position", new BufferAttribute(new Float32Array(3 * count), 3))
      .setAttribute("uv", new BufferAttribute(new Float32Array(2 * count), 2))
      .setIndex(triangles.flat());
    const material = new MeshBasicMaterial({
      map: this.texture,
      side: DoubleSide,
      toneMapped: false,
      fog: false,
      // surfaces are cut at the slices, and the pixels at their cut edges would have the same depth as the image
      polygonOffset: true,
      polygonOffsetFactor: -2,
      polygonOffsetUnits: -8,
    });
    this.mesh = new Mesh(geometry, material);
    this.mesh.frustumCulled = false;
    keepUnclipped(this.mesh); // the clip must not cut the slices
  }

  place(frames: readonly SliceFrame[], box: Box): void {
    const { position, uv } = this.mesh.geometry.attributes;
    const { width, height } = this.canvas;
    let left = BORDER_PX;
    this.slices.forEach((slice, plane) => {
      const outline = outlineOf(frames[plane], box);
      for (let i = 0; i < MAX_CORNERS; i++) {
        // unused corners repeat the last one, so that the remaining triangles have no area
        const corner = outline.length > 2 ? outline[Math.min(i, outline.length - 1)] : box.min;
        const { x, y } = placeIn(frames[plane], corner);
        const at = plane * MAX_CORNERS + i;
        position.setXYZ(at, ...corner);
        uv.setXY(at, (left + x * slice.width) / width, 1 - (BORDER_PX + y * slice.height) / height);
      }
      left += slice.width + 2 * BORDER_PX;
    });
    position.needsUpdate = true;
    uv.needsUpdate = true;
  }

  /** Copies the slices' new images into the texture. */
  refresh(): void {
    const sum = (widths: readonly number[]) => widths.reduce((all, width) => all + width, 0);
    this.canvas.width = sum(this.slices.map(({ width }) => width + 2 * BORDER_PX));
    this.canvas.height = Math.max(...this.slices.map(({ height }) => height)) + 2 * BORDER_PX;
    const context = this.canvas.getContext("2d");
    if (context === null) throw new Error("no 2D canvas");
    let left = 0;
    for (const slice of this.slices) {
      const { width, height } = slice;
      context.drawImage(slice, left, 0, width + 2 * BORDER_PX, height + 2 * BORDER_PX);
      context.drawImage(slice, left + BORDER_PX, BORDER_PX);
      left += width + 2 * BORDER_PX;
    }
    this.texture.dispose(); // a texture on the GPU cannot change its size
    this.texture.needsUpdate = true;
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
    this.texture.dispose();
  }
}

export class SlicePlanes {
  /** Child of the specimen's group, in um. */
  readonly group = new Object3D();
  /** Lines and letters, which write no depth. */
  readonly marks = new Object3D();
  private readonly planes: Planes;
  private readonly lines: LineSegments<BufferGeometry, LineBasicMaterial>;
  private readonly letters = Array.from({ length: 6 }, () => new Label("above", LETTER));
  private readonly places = Array.from({ length: 6 }, () => new Vector3());
  private version = -1;
  /** Number of times that the slices have moved. */
  private placed = 0;
  private place = "";
  private corner: readonly ClipPlane[] = [];

  constructor(private readonly images: SliceImages) {
    this.planes = new Planes(images.canvases);
    const positions = new BufferAttribute(new Float32Array(3 * 6), 3);
    const material = new LineBasicMaterial({ color: LINE, toneMapped: false, fog: false });
    this.lines = new LineSegments(
      new BufferGeometry().setAttribute("position", positions),
      material,
    );
    this.lines.frustumCulled = false;
    this.marks.add(this.lines, ...this.letters.map(({ sprite }) => sprite));
    this.group.name = "slices";
    this.group.add(this.marks, this.planes.mesh);
    this.group.visible = false;
  }

  sync(areShown: boolean): void {
    const { frames, box, point, hasLoaded } = this.images;
    this.group.visible = areShown && hasLoaded && frames !== null;
    if (!this.group.visible || frames === null) return;
    this.planes.place(frames, box);
    const place = JSON.stringify(frames);
    if (place !== this.place) this.placed++;
    this.place = place;
    const [first, second] = frames;
    // the lines where two slices meet: they run along the first slice's right, up and normal
    const arms: readonly (readonly [Vec3, string, string])[] = [
      [first.right, first.ends[1], first.ends[0]],
      [first.up, first.ends[2], first.ends[3]],
      [first.normal, "", ""],
    ];
    const [, , isUp] = [0, 0, dotOf(second.up, first.normal) > 0];
    const through = isUp ? [second.ends[2], second.ends[3]] : [second.ends[3], second.ends[2]];
    arms.forEach(([along, forth, back], i) => {
      const names = i === 2 ? through : [forth, back];
      const span = boxSpan([-AHEAD[1], AHEAD[1]], { origin: point, direction: along }, box);
      [1, 0].forEach((end, k) => {
        const at = span === null ? 0 : span[end];
        const place = this.places[2 * i + k];
        place
          .set(...along)
          .multiplyScalar(at)
          .add(new Vector3(...point));
        this.lines.geometry.attributes.position.setXYZ(2 * i + k, place.x, place.y, place.z);
        this.letters[2 * i + k].write(names[k]);
      });
    });
    this.lines.geometry.attributes.position.needsUpdate = true;
  }

  /** Returns the corner that hides the slices from an eye in um; undefined: no slices are shown. */
  cornerTowards(eye: Vec3): readonly ClipPlane[] | undefined {
    const { frames } = this.images;
    if (!this.group.visible || frames === null) return undefined;
    this.corner = cornerTowards(eye, frames, this.corner);
    return this.corner;
  }

  /** A number that changes when the slices move and so hide other parts of the specimen; 0: they are not shown. */
  get solid(): number {
    return this.group.visible ? 1 + this.placed : 0;
  }

  update(eyeView: EyeView): void {
    const { frames, box, version } = this.images;
    if (!this.group.visible || frames === null) return;
    if (this.version !== version) {
      this.version = version;
      this.planes.refresh();
      this.planes.place(frames, box); // the texture's size may have changed
    }
    this.letters.forEach((letter, i) => {
      letter.place(this.places[i], eyeView);
    });
  }

  dispose(): void {
    this.group.removeFromParent();
    this.planes.dispose();
    for (const letter of this.letters) letter.dispose();
    this.lines.geometry.dispose();
    this.lines.material.dispose();
  }
}

const dotOf = (a: Vec3, b: Vec3) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
