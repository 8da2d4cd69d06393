"""Import options that state what files leave open: `--as`, `--scale`, `--maps`, `--encoding`, ... of an import."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from ...runtime.errors import InputError, UnknownNameError
from ..spectrum import Quantity

Scale = Literal["percent", "fraction"]
#: Treatment of a file that contradicts the answer: refused, read as it states, or as answered.
Against = Literal["refused", "kept", "overruled"]
#: Decimal mark of a number in a table.
Decimal = Literal["comma", "point"]
#: Rendering of texture maps: texel by texel; that, with broken normals taken as level; by their mean.
MapsDrawn = Literal["texels", "mended", "mean"]
#: Rendering of readings at several angles: each as a matt surface.
AnglesDrawn = Literal["matt"]
#: Direction of green in a normal map: upwards in the picture, or downwards.
NormalMap = Literal["opengl", "directx"]
#: Content of a specular map: F at the normal, the colour of facets, encoded as sRGB or linear.
SpecularMap = Literal["f0-srgb", "f0-linear"]
#: Encoding of light in images: by the curve of sRGB, linearly, linearly as X, Y and Z of CIE 1931.
ImageEncoding = Literal["srgb", "linear", "xyz"]

#: Model of a BTF: by local PCA, ours or as it was published; by fields of polynomials, or of a number of lobes, shared
#: by all coefficients or one set for each.
BtfFormName = Literal[
    "lpca", "lpca-paper", "rfp", "rfnl-1", "rfnl-2", "rfnl-4",
    "rfnl-1-separate", "rfnl-2-separate", "rfnl-4-separate",
]  # fmt: skip


@dataclass(frozen=True)
class ImportOptions:
    """Quantity that was measured and scale that it is written on; None leaves that to the file.

    against : one answer is given for many files, and a file that states something else is refused, or kept as it is;
    of one file alone, the answer may count for more than its words.

    colours_for : illuminant and observer of XYZ and CIELAB that a file states without them; of one of the two, what
    it leaves open.

    decimal : the decimal mark of tables whose rows can be read in two ways.

    maps : None is "texels". normal_map : for normal maps that do not say it and do not prove it themselves.
    specular_map : without it specular maps are kept and not rendered.

    Of the images of a BTF: encoding; white, the linear number of a perfect diffuser lit and seen straight on, 1 at full
    scale, one or one a colour; includes_cosine, whether values fall with the cosine of the light; texel_mm; fill, the
    share of images that may be made of their neighbours; btf_form, the fast form that it gets.

    angles : "matt": each reading of a paint at several angles is a matt material of its own; None refuses them.

    Raises
    ------
    InputError
        A scale for an emission, which has none; an unknown word.
    """

    quantity: Quantity | None = None
    scale: Scale | None = None
    maps: MapsDrawn | None = None
    normal_map: NormalMap | None = None
    specular_map: SpecularMap | None = None
    encoding: ImageEncoding | None = None
    white: tuple[float, ...] | None = None
    includes_cosine: bool | None = None
    texel_mm: float | None = None
    fill: float | None = None
    btf_form: BtfFormName | None = None
    colours_for: tuple[str, str] | None = None
    angles: AnglesDrawn | None = None
    decimal: Decimal | None = None
    against: Against = "refused"

    def __post_init__(self) -> None:
        if self.quantity == "radiance-factor":
            # As the option is written, which messages name.
            object.__setattr__(self, "quantity", "radiance factor")
        said = (("as", self.quantity, Quantity), ("scale", self.scale, Scale))
        said += (("maps", self.maps, MapsDrawn), ("normal-map", self.normal_map, NormalMap))
        said += (("angles", self.angles, AnglesDrawn),)
        said += (("specular-map", self.specular_map, SpecularMap),)
        said += (("decimal", self.decimal, Decimal), ("against", self.against, Against))
        said += (("encoding", self.encoding, ImageEncoding), ("btf-form", self.btf_form, BtfFormName))
        for field, words, known in said:
            if words is not None and words not in get_args(known):
                kind = "quantity" if field == "as" else field
                raise UnknownNameError(kind, str(words), get_args(known), field=f"--{field}")
        if self.quantity == "emission" and self.scale is not None:
            raise InputError(
                "an emission is on no scale of 0 to 1",
                field="scale",
                found=self.scale,
                expected="no scale: spectral power is taken as it stands",
                hint="leave --scale out",
            )
        positive = (("white", self.white or ()), ("texel-mm", () if self.texel_mm is None else (self.texel_mm,)))
        for field, numbers in positive:
            if not all(0.0 < number < float("inf") for number in numbers):
                raise InputError("not a positive number", field=field, found=numbers, expected="numbers above 0")
        if self.fill is not None and not 0.0 <= self.fill < 1.0:
            raise InputError("not a share", field="fill", found=self.fill, expected="from 0 to below 1")

    def allows(self, quantity: str) -> bool:
        """Return whether a file that says `quantity` says nothing else than this answer does.

        A radiance factor is a reflectance in one geometry: the one word allows the other.
        """
        alike = {"reflectance", "radiance factor"}
        return self.quantity in (None, quantity) or {self.quantity, quantity} == alike


class AgainstAnswerError(InputError):
    """A file that states itself what a person answers otherwise; `part` : which part of the answer that is."""

    part: Literal["quantity", "scale"]

    @classmethod
    def of(cls, part: Literal["quantity", "scale"], **said: Any) -> AgainstAnswerError:
        """Return the refusal, with where it is and what was found, as of `InputError`."""
        made = cls(
            f"the file {'says one thing' if part == 'quantity' else 'states one scale'}, and "
            f"--{'as' if part == 'quantity' else 'scale'} another",
            expected="an answer only where the file leaves the question open",
            **said,
        )
        made.part = part
        return made


#: Leaves everything to the file.
NO_ANSWER = ImportOptions()


def contradiction(
    answer: ImportOptions, quantity: str, words: str, *, file: str | Path | None = None, field: str | None = None
) -> InputError:
    """Return the refusal of a file that says another quantity than the person who imports it."""
    return AgainstAnswerError.of(
        "quantity",
        file=file,
        field=field,
        found=f"{quantity}, by {words}; --as {str(answer.quantity).replace(' ', '-')}",
        hint="import this file without --as; where its words are wrong, correct them in the file",
    )
