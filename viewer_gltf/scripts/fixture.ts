/** Writes the synthetic bundle of the tests to a folder: `npm run fixture -- FOLDER`. */
import { writeFixture } from "../test/support/fixture/bundle";

const [folder] = process.argv.slice(2);
if (folder === undefined) {
  process.stderr.write("usage: npm run fixture -- FOLDER\n");
  process.exit(2);
}
const { channels } = await writeFixture(folder);
process.stdout.write(`${folder}: ${channels.map(({ name }) => name).join(", ")}\n`);
