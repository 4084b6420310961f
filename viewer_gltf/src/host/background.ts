/** The background of the flat view. The specimen has the same colours in front of every background. */
import type { Backdrop } from "../render/backdrop";
import type { SpecimenScene } from "../render/specimen_scene";
import type { Theme } from "../render/theme";

export class Background {
  /** Resolves when the background has loaded. */
  settled: Promise<void> = Promise.resolve();

  constructor(
    private readonly specimenScene: SpecimenScene,
    private readonly onChange: () => void,
  ) {}

  /**
   * @param isPlain one colour without a shadow, for cutting out the specimen and for users who need
   * more contrast
   */
  setTheme(theme: Theme, isPlain: boolean): void {
    const use = (backdrop: Backdrop | null) => {
      this.specimenScene.setTheme(theme, backdrop);
      this.onChange();
    };
    use(null);
    const fetched = isPlain ? Promise.resolve() : import("../render/backdrop");
    const settled: Promise<void> = fetched.then(
      (part) => {
        if (part && this.settled === settled) use(new part.Backdrop());
      },
      () => undefined, // the view is correct without the background
    );
    this.settled = settled;
  }
}
