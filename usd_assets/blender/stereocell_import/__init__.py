"""Blender add-on that imports a StereoCell stage with its materials and exports edits as a layer.

Blender's own importer cannot choose variants, drops the materials of volumes, ignores a colour that
was edited at the material's interface, and does not read lists of numbers. This add-on therefore
works in three steps. It selects variants in a layer over the stage (choice.py). It lets Blender
import that layer. It builds the missing materials and cameras from the stage's attributes
(looks.py, cameras.py).

overlay.py writes the artist's edits as a layer over the stage, for `stereocell bundle OUT --stage
LAYER`. The objects of a label map have a panel beside the 3D view (objects.py).

The add-on needs Blender 4.5 or newer. One Blender unit is 1 um, or 1 m if the specimen is imported
at its true size or enlarged to its display size.
"""

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

from .choice import ALL, AS_STAGED, Choice, open_stage, shared_functions
from .importing import DISPLAY, MICROMETRES, TRUE, describe_size, import_stage
from .objects import CLASSES
from .overlay import export_edits
from .problem import StageProblem

bl_info = {
    "name": "StereoCell stage",
    "author": "StereoCell",
    "version": (0, 1, 0),
    "blender": (4, 5, 0),
    "location": "File > Import, File > Export",
    "description": "Import StereoCell stages and export edits as a layer",
    "category": "Import-Export",
}

_STAGED = (AS_STAGED, "As in the stage", "The variant that the stage, or a layer over it, selects")


def _items(*names):
    return [_STAGED, *[(name, name, "") for name in names]]


def _find_functions(operator, _context, _text):
    """Return the names of the transfer functions that all channels of the chosen stage have."""
    try:
        return shared_functions(open_stage(operator.filepath))
    except StageProblem:
        return []


class ImportStereoCellStage(bpy.types.Operator, ImportHelper):
    """Import a StereoCell stage, or a layer over one"""

    bl_idname = "import_scene.stereocell"
    bl_label = "Import StereoCell stage"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    filename_ext = ".usda"
    filter_glob: StringProperty(default="*.usda;*.usdc;*.usd", options={"HIDDEN"})
    tiles: StringProperty(
        name="Tiles",
        description="Names or patterns of tiles, separated by commas, such as r0_c0, r1_*",
        default="*",
    )
    channels: EnumProperty(
        name="Channels",
        items=[
            (AS_STAGED, "As in the stage", "The channels that the stage shows"),
            (ALL, "All", "All channels, including those that the stage does not show"),
        ],
    )
    lod: EnumProperty(
        name="Level of detail",
        description="lod0 is the finest level. A tile with fewer levels shows its coarsest one",
        items=_items("lod0", "lod1", "lod2", "lod3"),
    )
    representation: EnumProperty(name="Show", items=_items("mesh", "volume", "both"))
    transfer_function: StringProperty(
        name="Transfer function",
        description="Name of a transfer function that all channels have. If it is empty, each "
        "channel has the function that the stage selects",
        search=_find_functions,
    )
    size: EnumProperty(
        name="Size",
        items=[
            (MICROMETRES, "1 unit is 1 um", "This size suits viewing, lighting and rendering"),
            (
                DISPLAY,
                "Display size",
                "1 unit is 1 m. The specimen is enlarged by a power of ten, to at most 1 m",
            ),
            (TRUE, "True size", "1 unit is 1 m, as for other objects in true size"),
        ],
    )

    is_lit: BoolProperty(
        name="Light the scene",
        description="Use the stage's lights, a dark backdrop, unchanged colours, and Cycles for "
        "volumes, so that the scene is ready to render. Otherwise lights and settings stay as they "
        "are",
        default=True,
    )
    is_stereo: BoolProperty(
        name="Render both eyes",
        description="Each image is rendered twice, for the left and the right eye",
        default=False,
    )

    def execute(self, context):
        function = self.transfer_function or AS_STAGED
        choice = Choice(self.tiles, self.lod, self.representation, function, self.channels)
        try:
            root = import_stage(
                context, self.filepath, choice, self.size, self.is_lit, self.is_stereo
            )
        except StageProblem as problem:
            self.report({"ERROR"}, str(problem))
            return {"CANCELLED"}
        context.view_layer.objects.active = root
        self.report({"INFO"}, f"The specimen is {describe_size(open_stage(self.filepath))}")
        return {"FINISHED"}


class ExportStereoCellEdits(bpy.types.Operator, ExportHelper):
    """Write the changes since the import as a layer over the stage"""

    bl_idname = "export_scene.stereocell_edits"
    bl_label = "Export StereoCell edits"

    filename_ext = ".usda"
    filter_glob: StringProperty(default="*.usda", options={"HIDDEN"})

    def execute(self, context):
        try:
            edits = export_edits(context, self.filepath)
        except StageProblem as problem:
            self.report({"ERROR"}, str(problem))
            return {"CANCELLED"}
        self.report({"WARNING" if edits.lost else "INFO"}, edits.summary())
        return {"FINISHED"}


def _import_entry(menu, _context):
    menu.layout.operator(ImportStereoCellStage.bl_idname, text="StereoCell stage (.usda)")


def _export_entry(menu, _context):
    menu.layout.operator(ExportStereoCellEdits.bl_idname, text="StereoCell edits (.usda)")


def register():
    """Register the add-on's classes and menu entries; Blender calls this."""
    bpy.utils.register_class(ImportStereoCellStage)
    bpy.utils.register_class(ExportStereoCellEdits)
    for one in CLASSES:
        bpy.utils.register_class(one)
    bpy.types.TOPBAR_MT_file_import.append(_import_entry)
    bpy.types.TOPBAR_MT_file_export.append(_export_entry)


def unregister():
    """Remove the add-on's classes and menu entries; Blender calls this."""
    bpy.types.TOPBAR_MT_file_export.remove(_export_entry)
    bpy.types.TOPBAR_MT_file_import.remove(_import_entry)
    for one in reversed(CLASSES):
        bpy.utils.unregister_class(one)
    bpy.utils.unregister_class(ExportStereoCellEdits)
    bpy.utils.unregister_class(ImportStereoCellStage)
