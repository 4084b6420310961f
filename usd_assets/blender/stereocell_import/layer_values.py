"""Write values into a layer."""

from pxr import Sdf


def set_value(layer, path, name, kind, value, is_uniform=False):
    """Set an attribute of a prim; the layer gets an override of the prim if it has none yet."""
    prim = layer.GetPrimAtPath(path) or Sdf.CreatePrimInLayer(layer, path)
    variability = Sdf.VariabilityUniform if is_uniform else Sdf.VariabilityVarying
    Sdf.AttributeSpec(prim, name, kind, variability).default = value
