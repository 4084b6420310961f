/** The form with the most important settings of an item. Each change is reported at once. */
import { element } from "../dom/element";
import type { Choices } from "./server";
import { BACKGROUNDS, NAMES, PRESETS } from "./setting_names";
import { spacingField } from "./spacing_field";
import type { Channel, Choice, Option, Understood } from "./understood";

type OnChange = (choices: Choices) => void;

/** @param name prefix of the controls' IDs, which differs between items */
export function settingsForm(
  understood: Understood,
  name: string,
  onChange: OnChange,
): HTMLFormElement {
  const { preset, series, background } = understood;
  const form = element("form", { className: "settings", ariaLabel: "Settings" });
  form.onsubmit = (event) => event.preventDefault(); // the page's security policy forbids sending forms
  form.append(
    titleField(understood, name, onChange),
    ...select("preset", NAMES.preset, preset && named(preset, PRESETS), name, onChange),
    ...select("series", NAMES.series, series, name, onChange),
    ...select(
      "background",
      NAMES.background,
      background && named(background, BACKGROUNDS),
      name,
      onChange,
    ),
    ...spacingOf(understood, name, onChange),
    ...channelField(understood, onChange),
  );
  return form;
}

/** Returns whether two summaries need the same form, which then stays on the page with its focus. */
export function isSameForm(a: Understood, b: Understood): boolean {
  const shape = ({ title, preset, series, background, ...rest }: Understood) =>
    JSON.stringify([
      ...[title, preset, series, background],
      ...[rest.chosenChannels, rest.channelOptions, rest.chosenSpacing_um],
    ]);
  return shape(a) === shape(b);
}

function named({ value, options }: Choice, names: Readonly<Record<string, string>>): Choice {
  const words = ({ id, text }: Option) => ({ id, text: names[id] ?? text });
  return { value, options: options.map(words) };
}

function titleField({ title }: Understood, name: string, onChange: OnChange): HTMLElement {
  const input = element(
    "input",
    { type: "text", value: title, id: `${name}-title`, maxLength: 200, autocomplete: "off" },
    { setting: "title" },
  );
  input.onchange = () => {
    const text = input.value.trim();
    if (text === "") input.value = title;
    else if (text !== title) onChange({ title: text });
  };
  return field(NAMES.title, input);
}

/** Returns a list of options; empty if there are fewer than two to choose from. */
function select(
  setting: "preset" | "series" | "background",
  label: string,
  choice: Choice | null,
  name: string,
  onChange: OnChange,
): readonly HTMLElement[] {
  if (choice === null || choice.options.length < 2) return [];
  const options = choice.options.map(({ id, text }) =>
    element("option", { value: id, textContent: text, selected: id === choice.value }),
  );
  const list = element("select", { id: `${name}-${setting}` }, { setting }, ...options);
  list.onchange = () => onChange({ [setting]: list.value });
  return [field(label, list)];
}

function spacingOf(
  { chosenSpacing_um }: Understood,
  name: string,
  onChange: OnChange,
): readonly HTMLElement[] {
  if (chosenSpacing_um.length === 0) return [];
  const { root } = spacingField(name, chosenSpacing_um, (spacing_um) => onChange({ spacing_um }));
  return [root];
}

function channelField(
  { channelOptions, chosenChannels, channels }: Understood,
  onChange: OnChange,
): readonly HTMLElement[] {
  if (channelOptions.length < 2) return [];
  const boxes = channelOptions.map(({ id, text }) => {
    const box = element(
      "input",
      { type: "checkbox", value: id, checked: chosenChannels.includes(id) },
      { setting: "channels" },
    );
    const known = channels.find((channel) => channel.name === text);
    return { box, label: element("label", {}, {}, box, ...channelWords(text, known)) };
  });
  const change = (changed: HTMLInputElement) => {
    const chosen = boxes.filter(({ box }) => box.checked).map(({ box }) => box.value);
    if (chosen.length === 0)
      changed.checked = true; // an image needs at least one channel
    else onChange({ channels: chosen });
  };
  for (const { box } of boxes) box.onchange = () => change(box);
  const labels = boxes.map(({ label }) => label);
  const legend = element("legend", { textContent: NAMES.channels });
  const list = element("div", { className: "channel-list" }, {}, ...labels);
  return [element("fieldset", {}, {}, legend, list)];
}

function channelWords(name: string, channel: Channel | undefined): readonly HTMLElement[] {
  const dot = element("span", { className: "dot", ariaHidden: "true" });
  dot.style.setProperty("--color", channel?.color || "transparent");
  const words = [dot, element("span", { textContent: name })];
  if (channel !== undefined && !channel.hasSurface) {
    words.push(element("small", { textContent: "volume only" }));
  }
  return words;
}

function field(label: string, control: HTMLInputElement | HTMLSelectElement): HTMLElement {
  const words = element("label", { textContent: label, htmlFor: control.id });
  return element("div", { className: "setting" }, {}, words, control);
}
