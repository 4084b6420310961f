"""Check that comments, docstrings, messages, labels and docs are in plain English.

    python -m tests.support.prose [--count] [FILE ...]

Without files, every file of the repository is checked. A hit is printed as FILE:LINE, the rule and
the sentence, and ends the check with exit code 1. `--count` prints the texts and hits by folder.

The rules are those that a program can hold: how a sentence begins, words of the glossary that have
a better one, and how long a sentence is. The prose linter vale has the same kinds of rule. It is
not used because its package fetches a program from the web when it first runs, and because it
reads neither the messages of Python and TypeScript nor GLSL.
"""

import ast
import io
import json
import re
import subprocess
import sys
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
Text = tuple[int, str]  # line in the file, counted from 1; text without its marks

MAX_WORDS = 30  # of a sentence of a comment, docstring or message
MAX_AVERAGE_WORDS = 18.0  # of the sentences of a page of docs
NO_SUBJECT = re.compile(
    r"^(what|whatever|who|whoever|whose|whom|which|of|those|one more|none of|the same of|so that)\b"
    r"(?!.*\?$)",
    re.IGNORECASE,
)
NO_NOUN = re.compile(
    r"^(it|they|them|these|both|neither|either)\b(?! (of|the|a|an)\b)", re.IGNORECASE
)
WORDS = {  # word that a reader stumbles over: word to write
    r"anew": "again",
    r"once more": "again",
    r"by turns": "alternately",
    r"at hand": "available",
    r"(told|said) in vain": "ignored",
    r"(held|holds?|holding) against": "compare with",
    r"(is|are|was|were) (told|bidden)": "is reported, is printed, is passed",
    r"frayed|frays": "noisy",
    r"given up|gives? up|gave up": "abandoned, stopped",
    r"spoil(t|s|ed)?": "damaged",
    r"rungs?|ladders?": "level, levels",
    r"strands?": "segment",
    r"thereof|therein|whereof|wherein|hither|thither|henceforth|else's": "plain words",
    r"ere|nought|naught|lest|amid|betwixt|unto": "plain words",
    r"no more of|nothing of it|none of it": "plain words",
}
STUMBLES = [(re.compile(rf"\b({old})\b", re.IGNORECASE), new) for old, new in WORDS.items()]
ALLOWED = {  # path: words of the sentence that may stay, at most ten lines
}


def _python(source: str) -> Iterator[Text]:
    lines: list[Text] = []
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT and not re.match(r"#( type:| noqa|!)", token.string):
            text = token.string.lstrip("#: ")
            is_whole_line = not token.line[: token.start[1]].strip()
            if (
                lines
                and is_whole_line
                and lines[-1][0] + lines[-1][1].count("\n") + 1 == token.start[0]
            ):
                lines[-1] = (lines[-1][0], f"{lines[-1][1]}\n{text}")
            else:
                lines.append((token.start[0], text))
    yield from lines
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.FunctionDef(name=name) if name.startswith("test_"):
                yield node.lineno, name.removeprefix("test_").replace("_", " ")
            case ast.Constant(value=str(text)) if text.count(" ") >= 3:
                yield node.lineno, text
            case ast.JoinedStr(values=parts):
                text = "".join(str(p.value) if isinstance(p, ast.Constant) else "X" for p in parts)
                if text.count(" ") >= 3:
                    yield node.lineno, text


TOKENS = re.compile(
    r"//[^\n]*(?:\n[ \t]*//[^\n]*)*|/\*.*?\*/"
    r"|\"(?:[^\"\\\n]|\\.)*\"|'(?:[^'\\\n]|\\.)*'|`(?:[^`\\]|\\.)*`",
    re.DOTALL,
)


def _typescript(source: str) -> Iterator[Text]:
    for found in TOKENS.finditer(source):
        text = re.sub(r"\$\{[^}]*\}", "X", found[0])
        if text[0] == "/":
            text = re.sub(r"(?m)^\s*(//+|/\*+|\*+/|\*) ?|\*/|<[^>]*>", "", text)
        elif text.count(" ") < 3 or "<" in text or "\n" in text:
            continue
        yield source.count("\n", 0, found.start()) + 1, text.strip("\"'`")


def _markdown(source: str) -> Iterator[Text]:
    hide = lambda found: re.sub(r"[^\n]", "", found[0])  # noqa: E731 - line numbers stay as they are
    source = re.sub(r"(?ms)^```.*?^```|^\|.*?$|^#.*?$|<!--.*?-->|^---.*?^---", hide, source)
    source = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", source)
    for found in re.finditer(r"(?:(?!\n\s*\n|\n\s*(?:[-*]|\d+\.) ).)+", source, re.DOTALL):
        yield source.count("\n", 0, found.start()) + 1, re.sub(r"^\s*([-*]|\d+\.) ", "", found[0])


def _hash_comments(source: str) -> Iterator[Text]:
    for found in re.finditer(
        r"(?m)^[\t @]*#[^!\n]*(?:\n[\t @]*#[^\n]*)*|(?<=\s)##? [^\n]*$", source
    ):
        yield source.count("\n", 0, found.start()) + 1, re.sub(r"(?m)^[\t @]*#+ ?", "", found[0])


def _schema(source: str) -> Iterator[Text]:
    for found in re.finditer(r'"(?:title|description)": ("(?:[^"\\]|\\.)*")', source):
        yield source.count("\n", 0, found.start()) + 1, json.loads(found[1])


READERS = {
    ".py": _python,
    **dict.fromkeys(
        (".ts", ".mjs", ".glsl", ".frag", ".vert", ".cs", ".hlsl", ".shader"), _typescript
    ),
    ".md": _markdown,
    **dict.fromkeys((".toml", ".yml", "Makefile"), _hash_comments),
    ".json": _schema,
}


def sentences(text: str) -> Iterator[str]:
    """Yield the sentences of a text: one for each full stop, blank line or heading."""
    text = re.sub(r"`[^`]*`", "code", text)
    for part in re.split(r"(?<=[.!?])\s+(?=[A-Z`])|\n\s*\n|:\s*\n", text):
        if one := " ".join(part.split()):
            yield one


def hits(path: str, text: str) -> Iterator[tuple[str, str]]:
    """Yield the rule and the sentence of each hit of one text."""
    for number, one in enumerate(sentences(text)):
        if NO_SUBJECT.search(one):
            yield "no subject", one
        elif number == 0 and NO_NOUN.search(one):
            yield "a pronoun without a noun", one
        for stumble, better in STUMBLES:
            if stumble.search(one):
                yield f"{stumble.pattern} (write: {better})", one
        if len(one.split()) > MAX_WORDS and "=" not in one:
            yield f"{len(one.split())} words, at most {MAX_WORDS}", one


def main(arguments: list[str]) -> int:
    is_count = "--count" in arguments
    names = [name for name in arguments if name != "--count"]
    if not names:
        names = subprocess.check_output(["git", "ls-files"], cwd=ROOT, text=True).split("\n")
    texts, found = Counter[str](), Counter[str]()
    for name in names:
        reader = next((r for end, r in READERS.items() if name.endswith(end)), None)
        if reader is None or name.endswith(("package.json", "package-lock.json")):
            continue
        room = "/".join(
            Path(name).parts[:3]
            if len(Path(name).parts) > 3
            else Path(name).parts[:2][:-1] or ["."]
        )
        for line, text in reader((ROOT / name).read_text("utf-8")):
            texts[room] += 1
            for rule, sentence in hits(name, text):
                found[room] += 1
                if not is_count:
                    print(f"{name}:{line}: {rule}: {sentence[:160]}")
    if is_count:
        for room in sorted(texts):
            print(f"{room:40} {texts[room]:6} texts {found[room]:5} hits")
        print(f"{'all':40} {sum(texts.values()):6} texts {sum(found.values()):5} hits")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
