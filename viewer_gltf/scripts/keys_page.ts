/** Makes docs/keys.md, the page of all keys, from the viewer's own tables: `npm run keys-page`. */
import { KEYS } from "../test/support/panel/all_keys";

const BEGIN = "<!-- begin of `npm run keys-page` -->\n";
const END = "<!-- end of `npm run keys-page` -->";

/** Returns a key in Markdown. A key that is a backtick needs double backticks around it. */
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

/** Returns the page with the keys of this version between its two marks. */
export function pageOfKeys(text: string): string {
  const [before, rest] = text.split(BEGIN);
  const [, after] = (rest ?? "").split(END);
  if (after === undefined) throw new Error("docs/keys.md: expected the two marks of keys-page");
  return `${before}${BEGIN}\n${KEYS.groups.map(section).join("\n")}\n${END}${after}`;
}
