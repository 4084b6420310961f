/** The page of all keys, docs/keys.md, made from the viewer's own tables by `npm run keys-page`. */
import { KEYS } from "../test/support/panel/all_keys";

const BEGIN = "<!-- begin of `npm run keys-page` -->\n";
const END = "<!-- end of `npm run keys-page` -->";

/** A key as it is printed in the page. A backtick stands between two backticks of Markdown. */
function shown(name: string): string {
  const text = name.replace("Arrow", "").replace(/^ $/, "Space");
  const code = text.includes("`") ? `\`\` ${text} \`\`` : `\`${text}\``;
  return code.replace("|", "\\|");
}

function section(group: (typeof KEYS.groups)[number]): string {
  const rows = group.keys.map(
    ({ keys, label }) => `| ${keys.map(shown).join(" or ")} | ${label} |\n`,
  );
  return `## ${group.name}\n\n| key | what it does |\n|---|---|\n${rows.join("")}`;
}

/** The page with the keys of this version between its two marks. */
export function pageOfKeys(text: string): string {
  const [before, rest] = text.split(BEGIN);
  const [, after] = (rest ?? "").split(END);
  if (after === undefined) throw new Error("docs/keys.md: expected the two marks of keys-page");
  return `${before}${BEGIN}\n${KEYS.groups.map(section).join("\n")}\n${END}${after}`;
}
