"""Reads IES TM-27-14 (.spdx): one spectral distribution in XML, with a header that says whose it is."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...runtime.errors import InputError
from ..spectrum import Quantity
from .import_options import NO_ANSWER, ImportOptions
from .registry import SpectralFile, names_its_file
from .shared.decisions import SETTLED_BY, divisor_by_format, power_per_frequency
from .shared.entry_rules import Gathering, in_visible
from .shared.words import measured, names_power, names_power_per_frequency, names_raw, quantity_in, unit_in
from .shared.xml import Vocabulary, element_words, kept, number, read_xml, root_name

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

NAME = "IES TM-27"
SUFFIXES = (".spdx",)
NAMESPACE = "iestm2714"
_OTHER_NAMESPACE = "http://www.ies.org/iestm2714"

# Quantity of each word of SpectralQuantity, and the unit that the standard gives it. The "factors" compare with the
# perfect diffuser; the standard's schema and its text call them value and factor.
_QUANTITIES: dict[str, tuple[Quantity, str]] = {
    "flux": ("emission", "W/nm"),
    "intensity": ("emission", "W/(sr nm)"),
    "irradiance": ("emission", "W/(m^2 nm)"),
    "radiance": ("emission", "W/(sr m^2 nm)"),
    "exitance": ("emission", "W/(m^2 nm)"),  # codespell:ignore exitance
    "relative": ("emission", "relative"),
    "reflectance": ("reflectance", ""),
    "transmittance": ("transmittance", ""),
    "r-value": ("radiance factor", ""),
    "r-factor": ("radiance factor", ""),
    "t-value": ("transmittance", ""),
    "t-factor": ("transmittance", ""),
}

_READ = (
    "SpectralQuantity", "ReflectionGeometry", "TransmissionGeometry", "BandwidthFWHM", "BandwidthCorrected",
    "SpectralData"
)  # fmt: skip
#: A person may say the scale of one file alone, against the format.
SCALED = True


# Quantities that are neither a spectral power nor a share of light.
_ANOTHER = re.compile(r"absorpt|lumin|(?<![a-z])lm(?![a-z])|lumen|(?<![a-z])cd(?![a-z])|(?<![a-z])lux|B[RST]+DF", re.I)
# Words in place of a geometry where there is none.
_NO_GEOMETRY = ("other", "none", "unknown", "n/a", "-")


def recognises(path: Path, head: bytes) -> bool:
    """True for XML whose root is that of TM-27, in any of its years."""
    name = root_name(head)
    return name is not None and (name.upper().startswith("IESTM27") or path.suffix.lower() in SUFFIXES)


@names_its_file
def read(path: Path, answer: ImportOptions = NO_ANSWER) -> SpectralFile:
    """Return the spectrum of a file, named by its description.

    Parameters
    ----------
    answer : about this file alone, it may say that its values are percents, against the format.

    Raises
    ------
    InputError
        Not well-formed, not TM-27, without spectral data, or of a quantity that is none of ours.
    """
    root = read_xml(path)
    known = Vocabulary(root, NAMESPACE)
    if not (known.name(root) or "").upper().startswith("IESTM27"):
        raise InputError("not an IES TM-27 file", field="root element", found=root.tag[:120], expected="IESTM2714")
    gathered = Gathering(path, NAME)
    if known.note and known.root_uri != _OTHER_NAMESPACE:
        gathered.note(known.note)
    header = known.child(root, "Header")
    about = {
        known.name(element) or "": text for element in known.children(header) if (text := (element.text or "").strip())
    }
    if root.get("version"):
        about["version"] = root.get("version", "")
    distributions = list(known.children(root, "SpectralDistribution"))
    if not distributions:
        raise InputError("no SpectralDistribution", expected="one with SpectralData")
    name = next(
        (about[key] for key in ("Description", "UniqueIdentifier", "CatalogNumber") if about.get(key)), path.stem
    )
    for place, element in enumerate(distributions, 1):
        _add(gathered, element, name if len(distributions) == 1 else f"{name} {place}", about, known, answer)
    return gathered.finish(kept(about))


def _add(
    gathered: Gathering, element: Element, name: str, about: dict[str, str], known: Vocabulary, answer: ImportOptions
) -> None:
    field = "SpectralData"
    quantity, told, units = _quantity(gathered, element, known, answer)
    points = list(known.children(element, field))
    grid = np.array([number(point.get("wavelength", ""), field) for point in points])
    samples = np.array([number((point.text or "").strip(), field) for point in points])
    grid, samples = gathered.ascending(name, grid, samples)
    scale = divisor_by_format(samples[in_visible(grid)], quantity, NAME, answer, unit_in(told))
    details = {"quantity": told, "units": units, "geometry": _geometry(element, known, quantity, told)}
    details |= {"bandwidth": known.text(element, "BandwidthFWHM")}
    details |= {"bandwidth corrected": known.text(element, "BandwidthCorrected")}
    details |= {"instrument": about.get("MeasurementEquipment", "")}
    for other in known.children(element):
        if known.name(other) not in _READ:
            details[known.name(other) or ""] = element_words(other)
    gathered.add_of_format(name, grid, samples, quantity, scale, details=kept(details))


def _quantity(
    gathered: Gathering, element: Element, known: Vocabulary, answer: ImportOptions
) -> tuple[Quantity, str, str]:
    """Return the quantity, the file's word for it, and its unit; an answer tells what no word does."""
    field = "SpectralQuantity"
    said = list(dict.fromkeys(element_words(one) for one in known.children(element, field)))
    told = said[0] if said else ""
    unknown = _ANOTHER.search(told) or names_raw(told)
    named = quantity_in(told) or ("emission" if names_power(told) and not unknown else None)
    quantity, units = _QUANTITIES.get(told.lower(), (measured(named), told))
    if len(said) > 1:
        raise InputError("two quantities of one spectrum", field=field, found=", ".join(said), expected="one")
    if quantity in ("emission", None) and names_power_per_frequency(told):
        raise power_per_frequency(field, told)
    another = names_raw(told) or (quantity is None and (unknown or named is not None))
    if quantity is None and answer.quantity is not None and not another:
        gathered.note(f"the import says {answer.quantity}, which SpectralQuantity {told!r} leaves open")
        return answer.quantity, told, units
    if quantity is None or another:
        hint = f"write one of them into the file, or {SETTLED_BY}"
        if told == "absorptance":
            hint = "absorptance is what reflectance and transmittance leave of 1"
        elif another:
            hint = "export spectral power, or reflectance or transmittance"
        raise InputError(
            "a quantity that is no reflectance, transmittance or emission" if told else "no SpectralQuantity",
            field=field,
            found=told or None,
            expected=", ".join(_QUANTITIES),
            hint=hint,
        )
    if told.lower() not in _QUANTITIES:
        gathered.note(f"SpectralQuantity {told!r} is none of the standard's words and taken as {quantity}")
    return quantity, told, units


def _geometry(element: Element, known: Vocabulary, quantity: Quantity, told: str) -> str:
    """Return the geometry of what was measured; one of something else belies the quantity."""
    reflected, sent = (known.text(element, f"{kind}Geometry") for kind in ("Reflection", "Transmission"))
    own, other = (sent, reflected) if quantity == "transmittance" else (reflected, sent)
    stated = [word for word in (own, other) if word and word.casefold() not in _NO_GEOMETRY]
    if stated and (quantity == "emission" or stated[0] != own):
        raise InputError(
            "the words say one thing, and the geometry another",
            field="SpectralQuantity",
            found=f"{told}, and the {'Reflection' if stated[0] == reflected else 'Transmission'}Geometry {stated[0]}",
            expected="a quantity that is measured so",
            hint="correct the one that is wrong",
        )
    return own or other
