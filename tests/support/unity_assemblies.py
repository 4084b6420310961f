"""Compile the Unity package's assemblies, and stubs of Unity's own, by Mono."""

import subprocess
from pathlib import Path

from support.unity_meta import PACKAGE, SAMPLES

HERE = Path(__file__).parents[1] / "unity"
STUBS = HERE / "stubs"
NEWTONSOFT = Path("/usr/lib/cli/Newtonsoft.Json-5.0/Newtonsoft.Json.dll")  # place in Debian
ZIP = "System.IO.Compression.FileSystem.dll"  # part of Mono, in a separate package of Debian

# Scripts of each assembly, and the assemblies that it may use. For one of the package, these
# are the names in its .asmdef.
ENGINE = ("UnityEngine",)
EDITOR = (*ENGINE, "UnityEditor", NEWTONSOFT.stem)
ASSEMBLIES: dict[str, tuple[list[Path], tuple[str, ...]]] = {
    "UnityEngine": (
        [STUBS / f"Unity{name}.cs" for name in ("Engine", "Math", "Textures", "Modules")],
        (),
    ),
    "UnityEditor": ([STUBS / "UnityEditor.cs", STUBS / "UnityAssets.cs"], ENGINE),
    "glTFast": ([STUBS / "GltFast.cs"], (*ENGINE, NEWTONSOFT.stem)),
    "Google.XR.Cardboard": ([STUBS / "Cardboard.cs"], ENGINE),
    "nunit.framework": ([STUBS / "NUnit.cs"], ()),
    "StereoCell": ([PACKAGE / "Runtime"], ENGINE),
    "StereoCell.Editor": ([PACKAGE / "Editor"], (*EDITOR, "glTFast", "StereoCell")),
    "StereoCell.Tests": (
        [PACKAGE / "Tests"],
        (*EDITOR, "nunit.framework", "StereoCell", "StereoCell.Editor"),
    ),
    "StereoCell.Samples.Cardboard": (
        sorted((SAMPLES / "Cardboard").glob("*.cs")),
        (*ENGINE, "StereoCell", "Google.XR.Cardboard"),
    ),
    "StereoCell.Samples.Cardboard.Editor": (
        [SAMPLES / "Cardboard" / "Editor"],
        (*EDITOR, "StereoCell", "StereoCell.Samples.Cardboard"),
    ),
}


def compile_assembly(
    folder: Path, name: str, *defines: str, kind: str = "library", blind: tuple[str, ...] = ()
) -> None:
    """Compile an assembly into a folder that already has the assemblies that it uses.

    blind  assemblies that are hidden from it
    """
    sources, seen = ASSEMBLIES.get(name, ([HERE / "Harness"], (*ASSEMBLIES, NEWTONSOFT.stem)))
    seen = tuple(each for each in seen if each not in blind)
    files = [
        f for source in sources for f in (source.rglob("*.cs") if source.is_dir() else [source])
    ]
    out = folder / f"{name}.{'exe' if kind == 'exe' else 'dll'}"
    # Unity 2022.3 takes C# 9, but Mono's compiler only C# 7.
    done = subprocess.run(
        [
            *("mcs", "-langversion:7", "-warnaserror", f"-target:{kind}", f"-out:{out}"),
            *(f"-d:{define}" for define in defines),
            *("-r:System.IO.Compression.dll", f"-r:{ZIP}"),
            *(f"-r:{folder / each}.dll" for each in seen),
            *sorted(map(str, files)),
        ],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
