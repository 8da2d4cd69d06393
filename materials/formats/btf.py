"""BTFs: folders of images of a flat sample, from many views under many lights, as UBO2003 and UTIA name them.

One image represents its set; the others are read with it. Neither names nor images state the encoding of light and the
white, which are asked for. The images stay in place.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.basis import SpectralBasis
from ...spectral.formats.exr import MAGIC, channel_names, check_size, samples_in
from ...spectral.formats.import_options import NO_ANSWER, ImportOptions
from ...spectral.formats.picture_header import exr_colours, other_than_srgb
from ...spectral.formats.spectral_exr import wavelength_of
from ...spectral.spectrum import Spectrum
from ...spectral.upsampling import upsampling
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM, validated_wavelengths
from ..btf.decoding import LINEAR_UPLIFT, Coding, is_grey, uplifted_basis
from ..btf.files import BtfFiles
from ..btf.hemisphere import Hemisphere
from ..btf.registration import registered
from ..btf.surface import MeasuredBtf
from ..records.material import Provenance
from ..records.source import MaterialSource, Rejected
from ..records.stored_files import StoredFiles
from .btf_names import bare_numbers, directions_of, image_name, is_first, members, set_folder, set_name
from .btf_survey import Sorted, sorted_files, surveyed
from .input_file import head_of
from .measured_source import placed
from .naming import id_word, printable
from .reading_cost import ReadingCost
from .spectral_channels import PLAIN

NAME = "BTF"
#: A BTF is known by the names of its images; a suffix says nothing.
SUFFIXES: tuple[str, ...] = ()
#: It asks how images are encoded, and which number is white.
ASKS_MORE = True
#: Default share of the images that may be made of their neighbours.
FILL = 0.01
# Largest angle of a direction from the normal, degrees.
_HORIZON = 90.0
# Measured, with a third to spare: bytes of a process beside a set, bytes a texel of each view, and seconds an image and
# a texel of each, decoded and compared.
_PROCESS_BYTES, _VIEW_BYTES, _IMAGE_S, _TEXEL_S = 300 << 20, 24, 2e-3, 1.2e-7
# Seconds per number of OpenEXR.
_NUMBER_S = 2.5e-7
# EXIF tag of a picture's orientation; 1 is upright.
_ORIENTATION, _UPRIGHT = 0x0112, 1


def recognises(path: Path, head: bytes) -> bool:
    """Return True for the first image of a set."""
    return image_name(path) is not None and is_first(path)


def check_named(path: Path) -> None:
    """Raise `InputError` for a named image that is not the representative of its set."""
    if image_name(path) is None or len(found := members(path)) < 2 or path not in found:
        return
    hint = f"name the folder {set_folder(path)}, or the first of its images, {found[0].name}"
    raise InputError(
        "one image of a BTF", file=path, found=f"one of {len(found)}", expected="the set as a whole", hint=hint
    )


def companions(path: Path) -> Iterable[Path]:
    """Return the other images of the set."""
    return tuple(other for other in members(path) if other != path)


def reading_cost(path: Path) -> ReadingCost:
    """Estimate the cost of the whole set, if its images are all like the first."""
    count, numbers = len(members(path)), samples_in(path)
    texels = numbers or _texels(path)
    seconds = _NUMBER_S * numbers if numbers else _IMAGE_S + _TEXEL_S * texels
    return ReadingCost(_PROCESS_BYTES + round(_VIEW_BYTES * np.sqrt(count) * texels), count * seconds)


def _texels(path: Path) -> int:
    from PIL import Image

    try:
        with Image.open(path) as picture:
            return picture.width * picture.height
    except Exception:  # whatever is wrong with it, reading says so
        return 1 << 16


def read_sources(path: Path, uplift: str, answer: ImportOptions = NO_ANSWER) -> Iterator[MaterialSource | Rejected]:
    """Yield the one record, "btf/NAME".

    Raises
    ------
    InputError
        A question without an answer; directions below the horizon or duplicated; images missing, damaged or of
        different sizes; an uplift that is not linear.
    """
    folder = set_folder(path)
    found = sorted_files(members(path), folder)
    with placed(folder):
        coding, basis, notes = _coding(found, folder, answer, uplift)
        images = _images(found, folder, coding, basis, answer)
        survey = surveyed(images, FILL if answer.fill is None else answer.fill, folder)
        registration = registered(survey.images, survey.pictures)
    images = _without_unused(survey.images, folder).with_offset(registration.offset)
    notes += [*header_notes(members(path), folder), *survey.notes, registration.words]
    notes += _grazing(images.views, images.lights)
    if survey.negative:
        notes.append(f"{survey.negative} numbers are below 0, and kept so")
    if images.texel_mm is not None:
        notes.append(f"a texel is {images.texel_mm:g} mm wide: as you said")
    if answer.btf_form is not None:
        notes.append(f"fast form {answer.btf_form}: as you said")
    label = set_name(path)
    views, lights = len(images.views), len(images.lights)
    spectral = basis.is_sampled
    said = f"{views} views x {lights} lights x {images.width} x {images.height} texels"
    provenance = Provenance(
        source=f"{printable(label)}, a BTF of {said}",
        licence="not stated in the files",
        kind="measured" if spectral else upsampling(LINEAR_UPLIFT).provenance,
        geometry=f"{views} views x {lights} lights",
        notes=" + ".join([said, *notes] + ([] if spectral else [f"spectra by {LINEAR_UPLIFT}, of linear sRGB"])),
    )
    parameters = MeasuredBtf(images, survey.means, answer.btf_form or "").parameters()
    original = {"folder": printable(folder.name), "views_degrees": found.views, "lights_degrees": found.lights}
    taken = f"reflectance, by the names of its images; {', '.join(notes[:3])}"
    yield MaterialSource(f"btf/{id_word(label)}", "btf", "btf", parameters, provenance, path, original, taken)


def _grazing(views: Hemisphere, lights: Hemisphere) -> list[str]:
    """Note the clamping beyond the outermost measured directions."""
    rules = ((views, "views", "they are held"), (lights, "light", "f_r is held and its cosine falls on"))
    notes = []
    for hemisphere, words, rule in rules:
        least, most = hemisphere.reach
        if least < _HORIZON:
            ends = f"{least:g} deg" + (f" ({most:g} on some sides)" if most > least else "")
            notes.append(f"{words} measured up to {ends} from the normal; beyond, {rule}")
    return notes


def _images(found: Sorted, folder: Path, coding: Coding, basis: SpectralBasis, answer: ImportOptions) -> BtfFiles:
    names = tuple(file.relative_to(folder).as_posix() for file in found.files)
    try:
        data = StoredFiles.of(folder, names)
    except OSError as reason:
        raise InputError("cannot be read", file=folder, found=reason.strerror or str(reason)) from None
    starts = np.concatenate([[0], np.cumsum(np.array(data.sizes, dtype=np.int64))])
    views, lights = Hemisphere(directions_of(found.views)), Hemisphere(directions_of(found.lights))
    images = BtfFiles(views, lights, 1, 1, basis, data, starts, found.index, coding, answer.texel_mm)
    height, width = _size(images, found)
    return replace(images, height=height, width=width)


def _without_unused(images: BtfFiles, folder: Path) -> BtfFiles:
    """Return the images without unusable files, which a record does not need."""
    data = images.data
    assert isinstance(data, StoredFiles)
    used = np.unique(images.index[images.index >= 0])
    if len(used) == len(data.names):
        return images
    names, sizes = (tuple(each[number] for number in used.tolist()) for each in (data.names, data.sizes))
    starts = np.concatenate([[0], np.cumsum(np.array(sizes, dtype=np.int64))])
    index = np.where(images.index >= 0, np.searchsorted(used, images.index), -1)
    return replace(images, data=StoredFiles.of(folder, names, sizes=sizes), starts=starts, index=index)


def _size(images: BtfFiles, found: Sorted) -> tuple[int, int]:
    """Return the size of the first image that can be read."""
    problem: InputError | OSError = FileNotFoundError("no images")
    for file in found.files:
        try:
            grey = found.wavelengths_nm is not None
            coding = images.coding.band(0) if grey else images.coding
            height, width, _ = coding.linear(file.read_bytes(), file, grey=grey).shape
        except (InputError, OSError) as reason:
            problem = reason
            continue
        return height, width
    raise problem if isinstance(problem, InputError) else InputError("cannot be read", found=str(problem))


def _coding(found: Sorted, folder: Path, answer: ImportOptions, uplift: str) -> tuple[Coding, SpectralBasis, list[str]]:
    """Choose the decoding of the images and the basis of their coefficients; return them with notes on the evidence."""
    first = next((file for file in found.files if _says(file)), found.files[0])
    head = head_of(first)
    channels, nm, kind = _channels(first, head) if head.startswith(MAGIC) else ((), None, "")
    if found.wavelengths_nm is not None:
        if nm is not None:
            raise InputError(
                "wavelengths in names, and in images", file=first, found=channels[:1], expected="one or the other"
            )
        nm, channels = found.wavelengths_nm, channels[:1]
    encoding, by = answer.encoding, "as you said"
    if nm is not None and head.startswith(MAGIC) and encoding is None:
        encoding, by = "linear", "as OpenEXR of one wavelength a channel is"
    if encoding is None and kind == "xyz":
        encoding, by = "xyz", "by the names of the channels"
    cosine, by_cosine = answer.includes_cosine, "as you said"
    if cosine is None and kind != "T":
        cosine, by_cosine = True, "as the naming of UBO2003 and UTIA has it, whose images are photographs"
    white, by_white = answer.white, "as you said"
    if white is None and kind == "T":
        white, by_white = (1.0,), "as channels of reflectance have it"
    numbers = bare_numbers(folder) if nm is None else []
    if numbers and not head.startswith(MAGIC) and is_grey(first.read_bytes()):
        raise InputError(
            "grey images in folders that are numbers: of one wavelength each, or grey samples",
            file=folder.parent,
            field="folders",
            found=", ".join(numbers[:6]),
            expected="a wavelength that says so, as in 550nm, or a name",
            hint="rename these folders: 550 to 550nm where it is a wavelength, else to a name with letters",
        )
    asked = [
        words
        for words, known in (
            ("--encoding srgb, linear or xyz", encoding),
            ("--white NUMBER", white),
            ("--includes-cosine yes or no", cosine),
        )
        if known is None
    ]
    if asked:
        raise InputError(
            "images that do not say what their numbers are",
            field=", ".join(words.split()[0].removeprefix("--") for words in asked),
            found=f"{len(found.files)} images, such as {printable(first.name)}",
            expected="how numbers stand for light, and that of a perfect white diffuser (1: full scale)",
            hint=f"say it with {' and '.join(asked)}",
        )
    assert encoding is not None and white is not None and cosine is not None
    if (encoding == "xyz") != (kind == "xyz") and (nm is not None or kind == "xyz"):
        raise InputError(
            "not what --encoding says", file=first, field="encoding", found=encoding, expected=kind or "srgb, linear"
        )
    if nm is None and uplift != LINEAR_UPLIFT:
        raise InputError(
            "an uplift that sums of images do not keep",
            field="uplift",
            found=uplift,
            expected=LINEAR_UPLIFT,
            hint="leave --uplift out for BTFs",
        )
    basis = uplifted_basis() if nm is None else SpectralBasis.sampled(validated_wavelengths(nm))
    ranges = [] if nm is None else _range_notes(nm, first)
    if len(white) not in (1, basis.size):
        raise InputError("not a white", field="white", found=white, expected=f"one number, or {basis.size}")
    words = {"srgb": "encoded by the curve of sRGB", "linear": "linear", "xyz": "linear X, Y and Z"}[encoding]
    shown = ", ".join(f"{number:g}" for number in white)
    notes = [f"numbers are {words}: {by}", f"a perfect diffuser is {shown}: {by_white}"]
    notes.append(f"{'the' if cosine else 'no'} cosine of the light is in them: {by_cosine}")
    return Coding(encoding, np.array(white), cosine, channels), basis, notes + ranges


def _says(path: Path) -> bool:
    """Return whether an image is undamaged, so that it can be taken as representative."""
    try:
        head = head_of(path)
    except InputError:
        return False
    if head.startswith(MAGIC):
        return bool(channel_names(path, head))
    return bool(head) and path.suffix.lower() != ".exr"


def _range_notes(nm: Float[np.ndarray, " L"], path: Path) -> list[str]:
    """Note assumptions about wavelengths that were not measured; refuse ranges that determine no colours."""
    low, high = WORKING_WAVELENGTHS_NM[[0, -1]]
    if nm.size < 2 or nm[-1] <= low or nm[0] >= high:
        found, expected = (
            f"{nm.size} from {nm[0]:g} to {nm[-1]:g} nm",
            f"two or more, some within {low:g} to {high:g} nm",
        )
        raise InputError("no spectrum of visible light", file=path, field="wavelengths", found=found, expected=expected)
    note = Spectrum.sampled(nm, np.full(nm.size, 0.5)).range_note(WORKING_WAVELENGTHS_NM)
    return [note] if note else []


def _channels(path: Path, head: bytes) -> tuple[tuple[str, ...], np.ndarray | None, str]:
    """Channels of an OpenEXR image that count, in order; their wavelengths; "T", "S0", "xyz" or ""."""
    names = channel_names(path, head)
    spectral: dict[str, dict[float, str]] = {}
    for name in names:
        if said := PLAIN.match(name):
            spectral.setdefault(said["kind"], {})[wavelength_of(*said.group(3, 4, 5))] = name
    for kind in ("T", "S0"):
        if kind in spectral:
            nm = sorted(spectral[kind])
            return tuple(spectral[kind][length] for length in nm), np.array(nm), kind
    last = {name.rpartition(".")[2].upper(): name for name in reversed(names)}
    for wanted, kind in (("XYZ", "xyz"), ("RGB", ""), ("Y", "")):
        if set(wanted) <= set(last):
            return tuple(last[letter] for letter in (wanted if len(wanted) == 3 else wanted * 3)), None, kind
    if len(names) == 1:
        return names * 3, None, ""
    found = ", ".join(names[:6]) or "no channels that can be read"
    raise InputError(
        "no image", file=path, field="channels", found=found, expected="R, G and B, X, Y and Z, or wavelengths"
    )


def header_notes(files: Sequence[Path], folder: Path) -> list[str]:
    """Return a note for each property that image headers state and that is ignored, with the number of images.

    Properties are orientation, profile and colour space; the first image is named. Files that cannot be opened are
    skipped; reading them reports the error.
    """
    from PIL import Image

    turned: list[tuple[Path, int]] = []
    profiled: list[Path] = []
    coloured: dict[str, list[Path]] = {}
    for file in files:
        try:
            with Image.open(file) as picture:
                orientation, profile = picture.getexif().get(_ORIENTATION, _UPRIGHT), picture.info.get("icc_profile")
                # Pillow has read the header of other formats.
                data = file.read_bytes() if picture.format in ("PNG", "AVIF", "BMP") else b""
                stated = ", ".join(other_than_srgb(picture, data))
        except Exception:  # OpenEXR, or damaged
            continue
        if orientation != _UPRIGHT:
            turned.append((file, orientation))
        if profile:
            profiled.append(file)
        if stated:
            coloured.setdefault(stated, []).append(file)
    notes = []
    if turned:
        name, asked = turned[0][0].relative_to(folder), turned[0][1]
        notes.append(f"images to be turned by EXIF: {len(turned)} ({name}: {asked}), read as they are stored")
    if profiled:
        name = profiled[0].relative_to(folder)
        notes.append(f"images with an ICC profile: {len(profiled)} ({name}), not applied")
    for stated, named in coloured.items():
        notes.append(f"images that say {stated}: {len(named)} ({named[0].relative_to(folder)}), not applied")
    first = next((file for file in files if file.suffix.lower() == ".exr"), None)
    stated = "" if first is None else ", ".join(_of_exr(first))
    if first is not None and stated:
        notes.append(f"images that say {stated}: OpenEXR, by the first ({first.relative_to(folder)}), not applied")
    return notes


def _of_exr(file: Path) -> tuple[str, ...]:
    """Read what an OpenEXR image of red, green and blue states; those of a set are written alike."""
    try:
        header = check_size(file, sys.maxsize)[0]
    except InputError:
        return ()
    return exr_colours(header.attributes) if {"R", "G", "B"} <= set(header.names) else ()
