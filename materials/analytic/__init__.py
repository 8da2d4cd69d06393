"""Reflection models with closed formulas: one file each, its GLSL twin beside it.

Begin with `model.py`, the interface; docs/adding_a_brdf.md adds one. `glossmeter.py` measures any surface's gloss.
"""

from .ashikhmin_shirley import AshikhminShirley
from .coated_diffuse import CoatedDiffuse
from .cook_torrance import CookTorrance
from .lambert import Lambert
from .metallic_roughness import MetallicRoughness
from .oren_nayar import OrenNayar

MODELS = (Lambert, OrenNayar, AshikhminShirley, CookTorrance, MetallicRoughness, CoatedDiffuse)
