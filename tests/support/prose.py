"""Check that comments, docstrings, messages, labels, test names and docs are in plain English.

    python -m tests.support.prose [--count] [FILE ...]

Without files, every file of the repository is checked. A hit is printed as FILE:LINE, the rule and
the sentence, and makes the exit code 1. `--count` prints the number of hits in each folder instead.

The linter vale is not used. It reads neither messages in Python and TypeScript nor GLSL, and its
package fetches a program when it first runs.
"""

import ast
import io
import re
import subprocess
import sys
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
MAX_WORDS = 30  # words in a sentence
SHORTEST_MESSAGE = 4  # words; shorter strings of code are names and keys
NO_SUBJECT = re.compile(  # at the start of a sentence that is no question
    r"(What(ever)?|Who(ever|se|m)?|Which|Of|Those|One more|None of)\b(?!.*\?$| to do\b)"
)
NO_NOUN = re.compile(r"(It|They|Them)\b|(Both|Neither|Either) (is|are|was|were|have)\b")
WORDS = {  # words that readers stumble over, and what to write
    r"anew|once more": "again",
    r"at hand": "available",
    r"(held|holds?|holding) against": "compare with",
    r"(is|are|was|were|be) (told|bidden)": "report, print, pass",
    r"frayed|frays": "noisy",
    r"given up|gives? up|gave up": "abandoned, stopped",
    r"spoil(t|s|ed)?": "damaged",
    r"rungs?|ladders?": "level, levels",
    r"strands?": "segment",
    r"thereof|therein|whereof|henceforth|nought|lest|amid|none of it|nothing of it": "plain words",
}
STUMBLES = [(re.compile(rf"\b({old})\b", re.IGNORECASE), new) for old, new in WORDS.items()]
SKIPPED = ("usd_assets/unity/LICENSE.md", "tests/support/prose.py", "tests/docs/test_prose.py")
# A sentence ends at a full stop, a blank line, a semicolon, or a colon that ends a line. It also
# ends before an item of a list, a row of a table, or a row such as "bins  number of bins".
ENDS = re.compile(
    r"(?<=[.!?])\s+(?=[A-Z(*\"'])|;\s|\n\s*\n|:\s*\n"
    r"|\n(?=\s*([-*]|\d+\.) |\s*[@|#]|\s*[\w.`,*/= -]+? {2,}\w)"
)
QUOTED = r"\"(?:[^\"\\\n]|\\.)*\"|'(?:[^'\\\n]|\\.)*'|`(?:[^`\\]|\\.)*`"
COMMENT_OR_STRING = re.compile(rf"//[^\n]*(?:\n[ \t]*//[^\n]*)*|/\*.*?\*/|{QUOTED}", re.DOTALL)


def _python(source: str) -> Iterator[tuple[int, str]]:
    last = (0, False)  # line of the last comment, and whether it stands alone
    blocks = list[tuple[int, str]]()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT and not re.match(r"#( type:| noqa|!)", token.string):
            line, text = token.start[0], token.string.lstrip("#: ")
            this = (line, not token.line[: token.start[1]].strip())
            if last == (line - 1, True) and this[1]:
                line, text = blocks[-1][0], f"{blocks.pop()[1]}\n{text}"
            blocks.append((line, text))
            last = this
    yield from blocks
    tree = ast.parse(source)
    inside = {id(p) for n in ast.walk(tree) if isinstance(n, ast.JoinedStr) for p in n.values}
    for node in (node for node in ast.walk(tree) if id(node) not in inside):
        match node:
            case ast.FunctionDef(name=name) if name.startswith("test_"):
                yield node.lineno, name.removeprefix("test_").replace("_", " ").capitalize()
            case ast.Constant(value=str(text)) if text.count(" ") >= SHORTEST_MESSAGE - 1:
                yield node.lineno, re.sub(r"(?m)^\s*(>>>|\.\.\.) .*\n([^\n>]+\n)?", "\n", text)
            case ast.JoinedStr(values=parts):
                words = (str(p.value) if isinstance(p, ast.Constant) else "X" for p in parts)
                yield node.lineno, "".join(words)


def _typescript(source: str) -> Iterator[tuple[int, str]]:
    for found in COMMENT_OR_STRING.finditer(source):
        text = re.sub(r"\$\{[^}]*\}", "X", found[0])
        if text[0] == "/":
            text = re.sub(r"(?m)^\s*(//+|/\*+|\*+/|\*) ?|\*/|<[^>]*>", "", text)
        elif text.count(" ") < SHORTEST_MESSAGE - 1 or "<" in text or "\n" in text:
            continue
        yield source.count("\n", 0, found.start()) + 1, text.strip("\"'`")


def _matches(source: str, pattern: str, marks: str = "$^") -> Iterator[tuple[int, str]]:
    for found in re.finditer(pattern, source):
        yield source.count("\n", 0, found.start()) + 1, re.sub(marks, "", found[0])


def markdown(source: str) -> Iterator[tuple[int, str]]:
    """Yield the paragraphs of a page, each with its line, without code, tables and headings."""
    code = r"(?ms)^```.*?^```|^\|.*?$|^#.*?$|<!--.*?-->|^---.*?^---"
    source = re.sub(code, lambda found: re.sub(r"[^\n]", "", found[0]), source)
    yield from _matches(re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", source), r"(?s)(?:(?!\n\s*\n).)+")


READERS = {
    (".py",): _python,
    (".ts", ".mjs", ".glsl", ".frag", ".vert", ".cs", ".hlsl", ".shader"): _typescript,
    (".md",): markdown,
    (".toml", ".yml", ".yaml", "Makefile", "Containerfile"): lambda source: _matches(
        source, r"(?m)(^[\t @]*#[^!\n]*\n?)+|(?<=\s)##? [^\n]*$", r"(?m)^[\t @]*#+ ?"
    ),
    (".schema.json",): lambda source: _matches(source, r'(?<=(?:cription|.."title)": ")[^"]+'),
}


def sentences(text: str) -> list[str]:
    """Return the sentences of a text, in which code between backticks is one word."""
    parts = ENDS.split(re.sub(r"`[^`]*`", "Code", text))
    return [" ".join(part.split()) for part in parts if part and part.strip(" \n-*")]


def hits(text: str) -> Iterator[str]:
    """Yield the rule and the sentence of each hit in one text."""
    for one in sentences(text):
        # A part that begins with a small letter continues a list or a message.
        if NO_SUBJECT.match(one):
            yield f"no subject: {one}"
        elif text.strip().startswith(one) and NO_NOUN.match(one):
            yield f"a pronoun without a noun: {one}"
        elif len(one.split()) > MAX_WORDS and not re.search(r"[=|]|->|doi\b", one):
            yield f"{len(one.split())} words, at most {MAX_WORDS}: {one}"
        for old, new in STUMBLES:
            if found := old.search(one):
                yield f"'{found[0]}', write {new}: {one}"


def main(arguments: list[str]) -> int:
    """Print the hits, or their number in each folder, and return the exit code."""
    names = [name for name in arguments if name != "--count"]
    names = names or subprocess.check_output(["git", "ls-files"], cwd=ROOT, text=True).split()
    count, lines, rooms = 0, [], Counter[str]()
    for name in (name for name in names if name not in SKIPPED):
        for reader in (reader for ends, reader in READERS.items() if name.endswith(ends)):
            for line, text in reader((ROOT / name).read_text("utf-8")):
                found = [f"{name}:{line}: {hit:.200}" for hit in hits(text)]
                count, lines = count + 1, lines + found
                rooms["/".join(name.split("/")[:-1][:3])] += len(found)
    rows = [f"{room or '.':42} {rooms[room]:5} hits" for room in sorted(+rooms)]
    print(*(rows if "--count" in arguments else lines), sep="\n")
    print(f"prose: {len(lines)} hits in {count} texts")
    return int(bool(lines))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
