/** The slices as images in the page and in the scene. This code is loaded separately, when slices are first shown. */
import "./slices.css";
import type { EyeView } from "../marks/style";
import type { Action } from "../state/actions";
import type { ViewerState } from "../state/viewer_state";
import { sharesOf, turnedBy } from "./slice_frame";
import { type SlicesOptions as ImagesOptions, SliceImages } from "./slice_images";
import { SlicePlanes } from "./slice_planes";
import { SliceView } from "./slice_view";

export type SlicesOptions = Omit<ImagesOptions, "onPaint"> &
  Readonly<{
    /** The part of the page with the stage, which shrinks while slices are shown. */
    view: HTMLElement;
    state: ViewerState;
    dispatch: (action: Action) => void;
  }>;

export class Slices {
  readonly images: SliceImages;
  readonly planes: SlicePlanes;
  private readonly pictures: SliceView;
  private state: ViewerState;

  constructor(private readonly options: SlicesOptions) {
    this.state = options.state;
    this.images = new SliceImages({ ...options, onPaint: () => this.show() });
    this.planes = new SlicePlanes(this.images);
    const { bounds_um } = options.manifest.specimen;
    this.pictures = new SliceView(options.view, this.images, {
      move: (point) => options.dispatch({ type: "move-slices", at: sharesOf(point, bounds_um) }),
      turn: (about, by_deg) => {
        const { sliceTurnX_deg, sliceTurnY_deg, sliceTurnZ_deg } = this.state;
        const turned = turnedBy([sliceTurnX_deg, sliceTurnY_deg, sliceTurnZ_deg], about, by_deg);
        options.dispatch({ type: "move-slices", turn_deg: turned });
      },
      window: (wider, higher) => this.shiftWindow(wider, higher),
    });
  }

  sync(state: ViewerState): void {
    this.state = state;
    this.images.sync(state);
    this.show();
  }

  private show(): void {
    this.planes.sync(this.state.hasSlicePlanes);
    this.pictures.update(this.state.hasSlicePictures);
  }

  update(eyeView: EyeView): void {
    this.planes.update(eyeView);
  }

  /** Changes the window of the first shown channel. */
  private shiftWindow(wider: number, higher: number): void {
    const channel = this.state.channels.find(({ shown }) => shown);
    if (channel === undefined) return;
    const [low, high] = channel.window;
    const window = [low - wider / 2 - higher, high + wider / 2 - higher] as const;
    this.options.dispatch({ type: "window", channel: channel.id, window });
  }

  dispose(): void {
    this.pictures.dispose();
    this.planes.dispose();
    this.images.dispose();
  }
}
