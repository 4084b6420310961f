"""Write values into a layer."""

from pxr import Sdf


def set_value(layer, path, name, kind, value, is_uniform=False):
    """Set an attribute of a prim, which is overridden where the layer has no opinion on it yet."""
    prim = layer.GetPrimAtPath(path) or Sdf.CreatePrimInLayer(layer, path)
    variability = Sdf.VariabilityUniform if is_uniform else Sdf.VariabilityVarying
    Sdf.AttributeSpec(prim, name, kind, variability).default = value
