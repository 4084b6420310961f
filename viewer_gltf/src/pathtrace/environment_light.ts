/** The environment that lights the traced volumes: a built-in one, the stage's or the user's. It loads on first use. */
import { viewerAddress } from "../bundle/address";
import { BundleError, TemporaryError } from "../bundle/errors";
import type { FileRef } from "../bundle/generated/bundle";
import type { EnvironmentTables } from "./environment_sampling";

export const PATHS_NOT_LOADED =
  "The part of the page for path tracing could not be loaded. Check the connection and try again.";
/** Name of the environment that comes from a file of the user. */
const OWN = "own";
/** Name of the environment that comes from the stage's dome lights. */
const STAGE = "stage";

/** The bundle and the file that hold the image of a stage's domes. */
export type StageEnvironment = Readonly<{ base: string; file: FileRef }>;

export class EnvironmentLight {
  /** Name of the last requested environment; "": none. */
  private name = "";
  private hasFailed = false;
  isLoading = false;

  constructor(
    /** The image of the stage's domes; null: it has none. */
    private readonly stageEnvironment: StageEnvironment | null,
    private readonly onTables: (tables: EnvironmentTables) => void,
    private readonly onChange: () => void,
    private readonly onError: (error: unknown) => void,
  ) {}

  /** Lights the scene by an environment, unless it is the current one. */
  sync(name: string): void {
    if (name !== OWN && name !== this.name) void this.load(name);
  }

  /** Lights the scene by a file of the user. Throws BundleError. */
  async lightBy(file: File): Promise<void> {
    const { readEnvironment } = await loadLightReader();
    this.onTables(await readEnvironment(file));
    this.name = OWN;
  }

  retryFailed(): void {
    if (this.hasFailed) this.forget();
  }

  /** Makes the next request load the environment again. */
  forget(): void {
    this.name = "";
  }

  private async load(name: string): Promise<void> {
    this.name = name;
    this.hasFailed = false;
    this.isLoading = true;
    try {
      const { loadEnvironment, loadStageEnvironment } = await loadLightReader();
      const { stageEnvironment } = this;
      const tables =
        name === STAGE && stageEnvironment !== null
          ? await loadStageEnvironment(stageEnvironment.base, stageEnvironment.file)
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

/** Loads the code that reads environment maps. Rejects with a TemporaryError. */
function loadLightReader() {
  return import("./environment_file").catch((cause) => {
    throw new TemporaryError(PATHS_NOT_LOADED, { cause });
  });
}
