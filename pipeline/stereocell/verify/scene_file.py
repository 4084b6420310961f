"""Check a scene in one file: its page, its blocks, and the bundle in them.

The first damaged part ends the check, since all later parts depend on it. The hash of each block is
compared. The bundle in the blocks passes the same checks as a bundle on a web host.
"""

import base64
import hashlib
import re
import tempfile
from collections.abc import Callable, Iterator, Sequence
from html.parser import HTMLParser
from pathlib import Path, PurePosixPath

from stereocell.bundle.manifest import MANIFEST
from stereocell.bundle.manifest import REMEDY as OF_BUNDLE
from stereocell.bundle.scene_blocks import REMEDY, VIEW, SceneBlocks, read_blocks
from stereocell.model.errors import CheckError, StereoCellError
from stereocell.verify.check_line import CheckLine, raise_on

_LIGHTS = "environments/"  # folder of the viewer's own files, which the bundle's list omits
_TAGS = {"html", "head", "meta", "title", "link", "body", "div", "script"}
_ADDRESS = {"src", "href", "srcset", "action", "data", "poster", "background", "formaction"}
# Sources in a policy that are not hosts: contents and addresses that the page itself makes.
_INNER = re.compile(r"'none'|data:|blob:|'unsafe-eval'|'sha256-[\w+/]+=*'")
_PATH = re.compile(r"[^/\\:\0]+(/[^/\\:\0]+)*")
_CODE = (re.compile(r"index-.*\.css"), re.compile(r"viewer-.*\.js"))


def check_scene(
    file: Path, checks_of_bundle: Callable[[Path], Sequence[tuple[str, Callable[[], str]]]]
) -> Iterator[CheckLine]:
    """Yield a line for each check of a scene; a damaged page or block ends the checks.

    checks_of_bundle  returns the names and functions of the checks of a bundle's folder
    """
    try:
        content = _read(file)
        yield CheckLine("scene page", True, _check_page(content))
        yield CheckLine("scene blocks", True, _check_blocks(content))
    except StereoCellError as error:
        yield CheckLine("scene", False, f"{file}: {error}")
        return
    with tempfile.TemporaryDirectory() as folder:
        bundle = Path(folder)
        try:
            _extract(content, bundle)
        except OSError as error:
            where = error.filename or bundle
            yield CheckLine("scene", False, f"{where}: can't be written: {error.strerror or error}")
            return
        for name, run in checks_of_bundle(bundle):
            try:
                yield CheckLine(name, True, run())
            except StereoCellError as error:
                line = str(error).replace(f"{bundle}/", f"{file}: ").replace(OF_BUNDLE, REMEDY)
                yield CheckLine(name, False, line)


def _extract(content: SceneBlocks, bundle: Path) -> None:
    """Write the files of a scene's bundle into a folder, where they are checked as a bundle."""
    for path, data in content.files.items():
        if not path.startswith(_LIGHTS):
            (bundle / path).parent.mkdir(parents=True, exist_ok=True)
            (bundle / path).write_bytes(data)


def _read(file: Path) -> SceneBlocks:
    """Return the content of a document. Raises CheckError if a part of it is missing."""
    try:
        document = file.read_bytes().decode()
    except OSError as error:
        raise CheckError(f"can't be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise CheckError(
            f"found byte {error.start} outside of UTF-8, so it is damaged: {REMEDY}"
        ) from None
    if not document.endswith("</html>\n"):
        raise CheckError(f"ends before </html>, so a part of it is missing: {REMEDY}")
    return read_blocks(document)


class _Page(HTMLParser):
    """A parser that lists the scripts and the problems of a document without its data blocks.

    A problem is anything that would request an address or run code outside the one script.
    """

    def __init__(self, text: str) -> None:
        super().__init__()
        self.policies: list[str] = []
        self.scripts: list[str] = []
        self.problems: list[str] = []
        self._in_script = False
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        words = {name: value or "" for name, value in attrs}
        if tag not in _TAGS:
            self.problems.append(f"found an element <{tag}>, expected none")
        for name in _ADDRESS & words.keys():
            if not words[name].startswith("data:"):
                self.problems.append(
                    f"found the address {words[name]:.60} in <{tag}>, expected none"
                )
        handlers = [name for name in words if name.startswith("on")]
        self.problems += [f"found a script {name} in <{tag}>, expected none" for name in handlers]
        if (kind := words.get("http-equiv", "").lower()) == "content-security-policy":
            if self.scripts:
                self.problems.append(
                    "found a script before the policy, expected it after the policy"
                )
            self.policies.append(words.get("content", ""))
        elif kind:
            self.problems.append(f"found <meta http-equiv={kind:.30}>, expected only the policy")
        self._in_script = tag == "script"
        if self._in_script:
            self.scripts.append("")
            if words:
                self.problems.append("found a block that `stereocell export` does not write")

    def handle_endtag(self, tag: str) -> None:
        self._in_script = False

    def handle_data(self, data: str) -> None:
        if self._in_script:
            self.scripts[-1] += data


def _check_page(content: SceneBlocks) -> str:
    """Check that the document runs only its own script, and can't request anything from a host."""
    page = _Page(content.rest)
    problems = list(page.problems)
    if len(page.policies) != 1:
        problems.append(f"found {len(page.policies)} policies, expected one")
    if len(page.scripts) != 1:
        problems.append(f"found {len(page.scripts)} scripts beside the blocks, expected one")
    for policy in page.policies:
        problems += _problems_of(policy, page.scripts)
    if content.view and not VIEW.fullmatch(content.view):
        problems.append(f"its view is {content.view:.60}, expected the end of a link, from #v=1 on")
    raise_on([f"{problem}: {REMEDY}" for problem in problems[:1]])
    return "one script, which the policy allows; no address of a host"


def _problems_of(policy: str, scripts: Sequence[str]) -> Iterator[str]:
    rules = {name: sources for name, *sources in map(str.split, policy.split(";")) if name}
    if rules.get("default-src") != ["'none'"]:
        yield "found a policy without default-src 'none', expected one with it"
    for name, sources in rules.items():
        for source in sources:
            if not _INNER.fullmatch(source):
                yield f"found {source:.60} in {name} of the policy, expected nothing from outside"
    for script in scripts:
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        if f"'sha256-{digest}'" not in rules.get("script-src", []):
            yield "found a script that the policy does not allow, so browsers refuse to run it"


def _is_within(path: str) -> bool:
    """Return whether a relative path leads to a file below its folder, on any system."""
    return bool(_PATH.fullmatch(path)) and ".." not in PurePosixPath(path).parts


def _check_blocks(content: SceneBlocks) -> str:
    """Check that the viewer's code and a bundle are present, at paths within their folder."""
    problems = [
        f"{path}: found a path outside of the bundle, expected one within it"
        for path in content.files
        if not _is_within(path)
    ]
    problems += [
        f"{pattern.pattern}: missing among the viewer's files"
        for pattern in _CODE
        if not any(map(pattern.fullmatch, content.page))
    ]
    if MANIFEST not in content.files:
        problems.append(f"{MANIFEST}: missing, expected the bundle's")
    raise_on([f"{problem}: {REMEDY}" for problem in problems[:1]])
    return f"{len(content.page)} files of the viewer, {len(content.files)} of the bundle"
