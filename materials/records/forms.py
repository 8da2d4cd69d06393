"""The fast forms that a record may hold, a row each, by the group of the file that they lie in."""

from __future__ import annotations

from ..btf.field_form import FieldForm
from ..btf.form import BtfForm
from ..core.fast import Fast
from ..factored.pack import FactoredBrdf
from ..svbrdf.maps_form import MapsForm
from ..svbrdf.texture_form import TextureForm

FORMS: dict[str, type[Fast]] = {form.NAME: form for form in (FactoredBrdf, TextureForm, MapsForm, BtfForm, FieldForm)}
