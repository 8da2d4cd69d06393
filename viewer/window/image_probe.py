"""Probe of a pixel of a spectral image."""

from __future__ import annotations

import numpy as np

from ...spectral.observers import OBSERVERS, observer
from .image_frame import ImageFrame
from .light_choice import LightChoice
from .probe import ProbeReading, ProbeSpectra
from .spectral_image import XyzPicture
from .state import Session

READ = "the image"


def image_reading(
    frame: ImageFrame, session: Session, number: int, choice: LightChoice, who: str, pixel: tuple[int, int]
) -> ProbeReading:
    """Read a pixel of side A (0) or B (1) with its spectrum; an image in XYZ has none.

    For a reflectance, `incident` is the chosen light, relative to equal energy of the same luminance; for emission the
    incident light is unknown, and `reflected` is the emission relit by the chosen light.

    Raises
    ------
    InputError : see `SpectralPicture.weights` and `XyzPicture.check`.
    """
    picture, eye = frame.picture(session, number), observer(who)
    own = frame.light(session, LightChoice.named(session.subject.own_light), who) if session.subject.own_light else None
    light = frame.light(session, choice, who)
    if isinstance(picture, XyzPicture):
        picture.check(eye, light, own, session.subject.luminance)
        column, row = pixel
        xyz = choice.dimming * picture.planes[:, row, column].astype(np.float64)
        names = picture.light or choice.words, picture.observer or OBSERVERS[who]
        return ProbeReading(pixel, (), (), float(picture.coverage[row, column]), *names, xyz, picture.white)
    weights, white = picture.weights(eye, light, own, session.subject.luminance)
    column, row = pixel
    xyz = choice.dimming * (weights @ picture.planes[:, row, column].astype(np.float64))
    nm, found = picture.wavelengths_nm, picture.spectrum(row, column)
    unknown = np.full(len(nm), np.nan)
    if picture.kind == "reflectance":
        assert light is not None
        even = float(np.trapezoid(eye.cmfs[:, 1], eye.wavelengths_nm)) / eye.luminous(light)
        incident = choice.dimming * even * light.averaged(nm).samples
        spectra = ProbeSpectra(nm, incident, incident * found, found, READ)
    else:
        factor = choice.dimming * picture.relighting(eye, light, own)
        spectra = ProbeSpectra(nm, unknown, factor * found, unknown, READ)
    return ProbeReading(pixel, (), (), 1.0, choice.words, OBSERVERS[who], xyz, white, spectra)
