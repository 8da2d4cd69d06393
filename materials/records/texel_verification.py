"""Verification of a BTF in a catalogue: its fast form is whole, and single texels have the error that it states."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...runtime.errors import InputError
from ..btf.form import BtfForm, FieldForm
from ..btf.reduced import reduced
from ..btf.surface import MeasuredBtf
from ..btf.texel_error import measured
from ..core.fit_error import FitError
from .material import MaterialRecord
from .stored_array import StoredArray
from .stored_files import StoredFiles

# Texels of a form that are decoded, evenly over the sample.
_DECODED = 64
# Of the largest number in a basis, what the same basis may differ by.
_SAME = 1e-6


def check_decodes(record: MaterialRecord) -> None:
    """Decode texels all over the sample, in every view and light; nothing where there is no fast form of a BTF.

    Raises
    ------
    InputError : a form that does not decode, or to numbers that are not finite.
    """
    fast = record.fast
    if not isinstance(fast, BtfForm | FieldForm):
        return
    form = fast.texels.form
    count = form.height * form.width if isinstance(fast, FieldForm) else fast.texels.form.number.size
    texels = np.unique(np.linspace(0, count - 1, _DECODED).astype(np.int64))
    try:
        for texel, values in zip(texels.tolist(), form.decoded(texels), strict=True):
            if not np.isfinite(values).all():
                raise InputError("a fast form that is not finite", field=f"texel {texel}", expected="numbers")
    except IndexError as reason:
        raise InputError("a fast form that does not decode", field=fast.WORDS, found=str(reason)) from None


def texels_measured_again(record: MaterialRecord) -> FitError | None:
    """Return the error of texels as `btf_form` measures it, with the texels that it draws.

    None where none is declared, or where it was measured otherwise: by another protocol, or in a basis of few
    coefficients that is found here with other vectors.
    """
    fast, declared = record.fast, None if record.fast is None else record.fast.texel_error
    if declared is None or not isinstance(fast, BtfForm | FieldForm):
        return None
    surface = record.surface()
    if not isinstance(surface, MeasuredBtf):
        return None
    form, images = fast.texels.form, reduced(surface.images)
    ours, theirs = images.basis.synthesis, form.basis.synthesis
    if ours.shape != theirs.shape or not np.allclose(ours, theirs, rtol=0.0, atol=_SAME * np.abs(theirs).max()):
        return None
    found = measured(images, form, seed=1)
    return found if (found.protocol, found.observer) == (declared.protocol, declared.observer) else None


def gone_words(gone: Sequence[StoredArray]) -> str:
    """Describe what is gone, and where it was; of images, how many of how many."""
    first = gone[0]
    if not isinstance(first, StoredFiles):
        return f"large arrays were left in a file that is gone: {first.file}"
    lost = sum(not (first.file / name).is_file() for name in first.names)
    return f"{lost} of {len(first.names)} images are gone that were left in {first.file}"
