/** The environment that lights what is traced: a built-in one or the user's, loaded when it is first wanted. */
import { viewerAddress } from "../bundle/address";
import { BundleError, TemporaryError } from "../bundle/errors";
import type { FileRef } from "../bundle/generated/bundle";
import type { EnvironmentTables } from "./environment_sampling";

export const PATHS_NOT_LOADED = "The part of the page that follows light could not be had.";
/** The name of an environment out of a file of the user's. */
const OWN = "own";
/** The name of the light of the stage's domes. */
const STAGE = "stage";

/** The bundle and the file that hold the image of a stage's domes. */
export type StageRoom = Readonly<{ base: string; file: FileRef }>;

export class EnvironmentLight {
  /** The name of the environment that was asked for last; "": none. */
  private name = "";
  private hasFailed = false;
  isLoading = false;

  constructor(
    /** The image of the stage's domes; null: it has none. */
    private readonly stageRoom: StageRoom | null,
    private readonly onTables: (tables: EnvironmentTables) => void,
    private readonly onChange: () => void,
    private readonly onError: (error: unknown) => void,
  ) {}

  /** Light by a built-in environment, unless it is the present one. */
  follow(name: string): void {
    if (name !== OWN && name !== this.name) void this.load(name);
  }

  /** Light by a file of the user's. Throws BundleError. */
  async lightBy(file: File): Promise<void> {
    const { readEnvironment } = await loadLightReader();
    this.onTables(await readEnvironment(file));
    this.name = OWN;
  }

  retryFailed(): void {
    if (this.hasFailed) this.forget();
  }

  /** Load it again when it is wanted next. */
  forget(): void {
    this.name = "";
  }

  private async load(name: string): Promise<void> {
    this.name = name;
    this.hasFailed = false;
    this.isLoading = true;
    try {
      const { loadEnvironment, loadStageRoom } = await loadLightReader();
      const { stageRoom } = this;
      const tables =
        name === STAGE && stageRoom !== null
          ? await loadStageRoom(stageRoom.base, stageRoom.file)
          : await loadEnvironment(viewerAddress(), name);
      if (this.name === name) this.onTables(tables);
    } catch (error) {
      if (!(error instanceof BundleError)) throw error;
      this.hasFailed = true;
      this.onError(error);
    } finally {
      this.isLoading = false;
      this.onChange();
    }
  }
}

/** Fetch the code that reads files of light. Rejects with a TemporaryError. */
function loadLightReader() {
  return import("./environment_file").catch((cause) => {
    throw new TemporaryError(PATHS_NOT_LOADED, { cause });
  });
}
