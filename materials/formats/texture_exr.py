"""Spectral OpenEXR pictures of many different pixels (Fichet, Pacanowski and Wilkie, JCGT 10(3), 2021): textures.

Channels `T.550,0nm` hold reflectance, `S0.550,0nm` emission, `S1` to `S3` its polarisation; lengths may be in any unit
of metres, or frequencies in hertz. Reflectances become a matt surface with a spectrum at every texel, unchanged. A
picture of few colours is a chart, with one spectrum per colour (`spectra`).
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.formats.exr import MAGIC, ExrPicture, channel_names, read_picture
from ...spectral.formats.import_options import NO_ANSWER, ImportOptions
from ...spectral.formats.shared.decisions import check_darkness
from ...spectral.formats.shared.entry_rules import in_visible
from ...spectral.formats.spectral_exr import MOST_COLOURS, wavelength_of
from ...spectral.projection import finer_note
from ...spectral.spectrum import Quantity, Spectrum
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM, validated_wavelengths
from ..records.material import Provenance
from ..records.source import MaterialSource, Rejected
from .measured_source import placed, sha256_of
from .naming import id_word, printable
from .reading_cost import ReadingCost, cost_of_picture
from .spectra import read_sources as read_chart
from .spectral_channels import PLAIN, is_spectral, is_spectral_base

NAME = "spectral texture (OpenEXR)"
SUFFIXES = (".exr",)
#: It asks whether a picture is as dark as it says.
ASKS_MORE = True
#: 2048 x 2048 of 32 wavelengths: half a gigabyte as floats.
MOST_SAMPLES = 1 << 27
# No surface sends back so much at one wavelength on average over all of its texels.
_BRIGHTEST = 2.0
_PREVIEW = ("R", "G", "B", "A", "Y", "RY", "BY")
_LONGEST_TEXT = 32000


@dataclass(frozen=True, eq=False)
class TextureImage:
    """One quantity of one layer: values (H,W,L) as stored, at ascending wavelengths."""

    layer: str
    kind: str
    wavelengths_nm: Float[np.ndarray, " L"]
    values: np.ndarray


def recognises(path: Path, head: bytes) -> bool:
    """Return True for OpenEXR with spectral channels or an unreadable header; a base colour belongs to its set."""
    if not head.startswith(MAGIC) or is_spectral_base(path, head):
        return False
    names = channel_names(path, head)
    return not names or any(map(is_spectral, names))


def reading_cost(path: Path) -> ReadingCost:
    """Estimate the cost of its pixels, as the header counts them."""
    return cost_of_picture(path)


def read_sources(path: Path, uplift: str, answer: ImportOptions = NO_ANSWER) -> Iterator[MaterialSource | Rejected]:
    """Yield the texture's record, "textures/NAME"; where there are several layers or quantities, one for each.

    Spectra need no `uplift`.

    Raises
    ------
    InputError
        Damaged, too large, no spectral channels, a wavelength twice, channels of different sizes; a value that is NaN
        or infinite; a mean that nothing reflects; reflectances darker than any surface, unless the `answer` is that
        they are fractions.
    """
    picture = read_picture(path, MOST_SAMPLES)
    textures = spectral_textures(picture, path)
    if len(textures) == 1 and not _others(picture) and _is_chart(textures[0].values):
        chart = _chart(path, uplift, answer)
        if chart:
            yield from chart
            return
    content = sha256_of(path)
    main = [texture for texture in textures if texture.kind in ("S0", "T")]
    for texture in main:
        words = [path.stem, texture.layer, "emission" if len(main) > 1 and texture.kind == "S0" else ""]
        name = "-".join(id_word(word) for word in words if word)
        try:
            beside = [other for other in textures if other.layer == texture.layer and other.kind[0] == "S"]
            polarised = [other for other in beside if texture.kind == "S0" != other.kind]
            notes = [f"{printable(path.name)}: SHA-256 {content}"]
            yield _source(path, name, picture, texture, polarised, notes, answer)
        except InputError as reason:
            yield Rejected(f"{path.name}: {texture.kind}", reason)
    if not main:
        _refuse(path, "channels", "polarisation without its intensity", textures[0].kind, "S0 channels too")


def _chart(path: Path, uplift: str, answer: ImportOptions) -> list[MaterialSource | Rejected]:
    """Return one material per colour; none if the reader of charts does not support the picture's units or layers."""
    try:
        return list(read_chart(path, uplift, answer))
    except InputError:
        return []


def spectral_textures(picture: ExrPicture, path: Path) -> list[TextureImage]:
    """Read every quantity of every layer; raises `InputError` if channels are inconsistent."""
    found: dict[tuple[str, str], dict[float, np.ndarray]] = {}
    for name, pixels in picture.channels.items():
        if match := PLAIN.match(name):
            held = found.setdefault((match["layer"] or "", match["kind"]), {})
            length = wavelength_of(*match.group(3, 4, 5))
            if length in held:
                _refuse(path, name, "two channels hold the same wavelength", f"{length:g} nm", "each wavelength once")
            held[length] = pixels
    if not found:
        shown = ", ".join(list(picture.channels)[:6])
        _refuse(path, "channels", "no spectral channels", shown, "channels such as T.550,0nm or S0.550,0nm")
    textures = []
    for (layer, kind), held in sorted(found.items()):
        with placed(path, f"{kind} channels", "correct the names of the channels"):
            grid = validated_wavelengths(sorted(held))
        shapes = {pixels.shape for pixels in held.values()}
        if len(shapes) > 1:
            _refuse(path, f"{kind} channels", "channels of different sizes", shapes, "one size for all wavelengths")
        values = np.stack([held[length] for length in grid.tolist()], axis=-1)
        _check_finite(path, kind, values, grid)
        textures.append(TextureImage(layer, kind, grid, values))
    return textures


def _check_finite(path: Path, kind: str, values: np.ndarray, grid: np.ndarray) -> None:
    if values.size and not np.isfinite(values).all():
        row, column, at = (int(index) for index in np.argwhere(~np.isfinite(values))[0])
        found = f"{values[row, column, at]} at {grid[at]:g} nm"
        _refuse(path, f"{kind} pixel ({row}, {column})", "not a finite number", found, "finite values")


def _is_chart(values: np.ndarray) -> bool:
    """Return whether there are at most `MOST_COLOURS` different pixels; a sample is checked first."""
    pixels = values.reshape(-1, values.shape[-1])
    step = max(len(pixels) // 4096, 1)
    if len(np.unique(pixels[::step], axis=0)) > MOST_COLOURS:
        return False
    whole = np.ascontiguousarray(pixels).view(np.dtype((np.void, pixels.dtype.itemsize * pixels.shape[1])))
    return len(np.unique(whole)) <= MOST_COLOURS


def _source(
    path: Path,
    name: str,
    picture: ExrPicture,
    texture: TextureImage,
    polarised: list[TextureImage],
    notes: list[str],
    answer: ImportOptions,
) -> MaterialSource:
    height, width, count = texture.values.shape
    mean = texture.values.mean(axis=(0, 1), dtype=np.float64)
    grid = texture.wavelengths_nm
    model, parameters, said = surface_of(texture, mean, path, answer)
    shown = "each of which is rendered" if "texture" in parameters else "of which the mean is kept as a spectrum"
    sentences = [f"{width} x {height} texels, {shown}", *said]
    if any(name.rpartition(".")[2] in ("R", "G", "B") for name in picture.channels):
        sentences.append("the RGB preview in the file is not kept")
    provenance = Provenance(
        source=f"{printable(path.name)}, a spectral OpenEXR texture of {count} wavelengths",
        licence="not stated in the file",
        kind="measured",
        notes=" + ".join([*sentences, *notes]),
    )
    original: dict[str, Any] = {
        "file": printable(path.name),
        "quantity": model.replace("_", " ") if not parameters else "reflectance",
        "wavelengths_nm": grid,
        "values": mean,
        "texture.wavelengths_nm": grid,
        "texture.quantity": "emission" if texture.kind == "S0" else "reflectance",
    }
    if not parameters:
        original["texture.values"] = texture.values
    for other in polarised:
        key = f"texture.{other.kind}"
        original |= {f"{key}.values": other.values, f"{key}.wavelengths_nm": other.wavelengths_nm}
    for channel, pixels in _others(picture).items():
        original[f"channel.{printable(channel)}"] = pixels
    original |= header_of(picture.attributes)
    return MaterialSource(f"textures/{name}", "textures", model, parameters, provenance, path, original)


def surface_of(
    texture: TextureImage, mean: np.ndarray, path: Path, answer: ImportOptions
) -> tuple[str, dict[str, Any], list[str]]:
    """Return a matt surface or, if the mean exceeds 1 or is an emission, the mean as a spectrum without a surface."""
    values, grid = texture.values, texture.wavelengths_nm
    notes = []
    negative = int((values < 0).sum())
    if negative:
        notes.append(f"{negative} of {values.size} values are negative, down to {values.min():.3g}, and kept so")
    if texture.kind == "S0":
        Spectrum.sampled(grid, _checked(mean, "emission", path), "emission")
        return "emission", {}, notes
    if mean.max() > _BRIGHTEST:
        found = f"{mean.max():.4g} on average at {grid[int(mean.argmax())]:g} nm"
        hint = "divide its values by 100; where they are radiances, name its channels S0"
        problem, expected = "reflectance looks like percent", "fractions of 1"
        raise InputError(problem, file=path, field="T channels", found=found, expected=expected, hint=hint)
    try:
        check_darkness(values[..., in_visible(grid)].max(axis=(0, 1)), NAME, answer)
    except InputError as reason:
        hint = "where they are radiances, name its channels S0; else say --scale fraction where that is right"
        raise reason.at(file=path, field="T channels", hint=hint) from None
    above = int((values > 1).sum())
    if above:
        notes.append(f"{above} of {values.size} values exceed 1, up to {values.max():.3g}, and are kept so")
    if mean.max() > 1.0:
        Spectrum.sampled(grid, _checked(mean, "radiance factor", path), "radiance factor")
        return "radiance_factor", {}, notes
    nm = WORKING_WAVELENGTHS_NM
    if grid.size < 2 or grid[-1] <= nm[0] or grid[0] >= nm[-1]:
        found = f"{grid.size} from {grid[0]:g} to {grid[-1]:g} nm"
        expected = f"two or more, some within {nm[0]:g} to {nm[-1]:g} nm"
        _refuse(path, "wavelengths", "no spectrum of visible light", found, expected)
    spectrum = Spectrum.sampled(grid, _checked(mean, "reflectance", path), "reflectance")
    assumed = (spectrum.range_note(nm), finer_note(grid))
    notes += ["taken to be perfectly diffuse", *(note for note in assumed if note)]
    return "spectral_texture", {"wavelengths_nm": grid, "texture": values}, notes


def _checked(mean: np.ndarray, quantity: Quantity, path: Path) -> np.ndarray:
    if mean.min() < 0:
        _refuse(path, "mean", f"negative {quantity}", f"{mean.min():.3g} on average", "0 or more")
    return mean


def _others(picture: ExrPicture) -> dict[str, np.ndarray]:
    """Channels that are neither spectral nor a preview: depth, coverage, ..."""
    return {
        name: pixels
        for name, pixels in picture.channels.items()
        if not PLAIN.match(name) and name.rpartition(".")[2] not in _PREVIEW
    }


def header_of(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the header's attributes, each as its text: units, exposure, handedness, the preview's light, ..."""
    found: dict[str, Any] = {}
    for name, value in attributes.items():
        text = printable(value if isinstance(value, str) else _worded(value))
        key = f"exr.{printable(name)}"
        found[key] = text if len(text) < _LONGEST_TEXT else np.frombuffer(text.encode(), np.uint8)
    return found


def _worded(value: Any) -> str:
    plain = [part.tolist() if isinstance(part, np.ndarray) else part for part in np.atleast_1d(cast(Any, value))]
    try:
        return json.dumps(plain[0] if len(plain) == 1 else plain)
    except TypeError:
        pass
    try:
        return str(value)
    except ValueError:
        # An attribute of a type of its own, whose name is no text.
        return f"not readable, {type(value).__name__}"


def _refuse(path: Path, field: str, problem: str, found: object, expected: str) -> None:
    hint = "save the picture again from the program that made it"
    raise InputError(problem, file=path, field=field, found=found, expected=expected, hint=hint)
