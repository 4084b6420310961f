/** Three fields for the voxel spacing, which some files state wrongly or not at all. */
import { element } from "../dom/element";
import { NAMES } from "./setting_names";

export type SpacingField = Readonly<{
  root: HTMLElement;
  /** x, y, z in um; null: a field has no length. */
  read: () => readonly number[] | null;
}>;

/** Digits that a field shows. */
const DIGITS = 4;

/** Units of a field: the sign, the name, and how many um. */
const MICROMETRE = { sign: "µm", name: "micrometres", um: 1 };
const MILLIMETRE = { sign: "mm", name: "millimetres", um: 1000 };

/** Returns the unit of the fields: mm for the spacing of a scanner, um for that of a microscope and if none is known. */
function unitOf(spacing_um: readonly number[]) {
  return Math.max(0, ...spacing_um) < 100 ? MICROMETRE : MILLIMETRE;
}

/** Reads a length above 0, with a decimal point or comma; null if the text is not a length. */
export function lengthOf(text: string): number | null {
  const value = Number(text.trim().replace(",", "."));
  return text.trim() !== "" && Number.isFinite(value) && value > 0 ? value : null;
}

/**
 * @param name prefix of the fields' IDs, which differs between items
 * @param spacing_um x, y, z; empty: not known
 * @param onChange called once all three have a length
 */
export function spacingField(
  name: string,
  spacing_um: readonly number[],
  onChange: (spacing_um: readonly number[]) => void,
): SpacingField {
  const unit = unitOf(spacing_um);
  const inputs = ["x", "y", "z"].map((axis, i) => {
    const known = spacing_um[i];
    const input = element(
      "input",
      {
        type: "text",
        inputMode: "decimal",
        autocomplete: "off",
        id: `${name}-spacing-${axis}`,
        value: known === undefined ? "" : String(Number((known / unit.um).toPrecision(DIGITS))),
        ariaLabel: `${NAMES.spacing} along ${axis}, in ${unit.name}`,
      },
      { setting: `spacing-${axis}` },
    );
    return { axis, input, known, text: input.value };
  });
  const read = () => {
    // a field that nobody has changed keeps the digits that it does not show
    const values = inputs.map(({ input, known, text }) => {
      if (known !== undefined && input.value === text) return known;
      const length = lengthOf(input.value);
      return length && length * unit.um;
    });
    return values.every((value) => value !== null) ? values : null;
  };
  for (const { input } of inputs) {
    input.onchange = () => {
      input.ariaInvalid = String(input.value !== "" && lengthOf(input.value) === null);
      const values = read();
      if (values !== null) onChange(values);
    };
  }
  const fields = inputs.map(({ axis, input }) =>
    element(
      "span",
      { className: "axis" },
      {},
      element("span", { textContent: axis, ariaHidden: "true" }),
      input,
    ),
  );
  const legend = element("legend", { textContent: `${NAMES.spacing}, ${unit.sign}` });
  const row = element("div", { className: "axes" }, {}, ...fields);
  return { root: element("fieldset", { className: "spacing" }, {}, legend, row), read };
}
