"""Display transform from relative XYZ to code values: adaptation, OpenColorIO, and counting of clipped pixels.

The chain is `XYZ under the scene's white -> chromatic adaptation -> XYZ-D65 -> OCIO display and view -> [0, 1]`.
Adaptation is applied only here. The default view is colorimetric, without tone mapping: a perfect diffuser is display
white, and colours that the display cannot show are clipped, counted and reported. The first view of the same
configuration maps that white to about 0.7, so OCIO's default view is never used.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from ...calibration.display.aim import PICTURE_WHITE_XYZ
from ...calibration.display.icc_profile import PREFIX, SCREEN, DisplayProfile, exact_on_cpu, read_display_profile
from ...runtime.errors import InputError, UnknownNameError
from ...runtime.files import existing_file
from ...spectral.adaptation import Method, adaptation_matrix
from ...spectral.difference import delta_e_xyz
from ...spectral.image import ColourImage
from ...spectral.observers import observer, observer_name
from .config import DEFAULT_VIEW, PINNED_CONFIG, described_observer, name_for, profile_config
from .screen_profile import screen_profile

INTERCHANGE_ROLE = "cie_xyz_d65_interchange"

# White of the interchange space.
DISPLAY_WHITE_XYZ = PICTURE_WHITE_XYZ
# ΔE94 of displayed white above which a view is not colorimetric: a step of eight bits.
WHITE_TOLERANCE = 0.5

# ΔE94 above which a pixel counts as clipped on a display whose profile limits codes to the gamut.
_BEYOND = 1.0
# Tables with white between nodes have such an error.
_TABLE_STEP = 0.01
# Encoded values this far outside [0, 1] count as clipped: a quarter of an 8-bit step, well above float32 rounding.
CLIP_TOLERANCE = 1e-3
# Multiple of white for testing whether a view limits brighter colours, and its rounding error.
_BRIGHT, _SAME = 10.0, 0.02
# Luminance of black, relative to white, attributed to rounding.
_NO_LIGHT = 1e-6
# Value shown for invalid pixels.
NOT_A_NUMBER_RGB = (1.0, 0.0, 1.0)


@dataclass(frozen=True)
class DisplayTransform:
    """Transform from XYZ for a display and view of an OCIO configuration, or for an ICC profile.

    Parameters
    ----------
    display, view : names in the configuration, "" for its first display; or `icc:FILE`, or `icc:screen` for the profile
        of the system's first screen, which have only the colorimetric view.
    config : a path or an `ocio://` name; None is `$OCIO` if set, else the pinned built-in configuration.
    adaptation : `Bradford`, `CAT02` or `CAT16`, from the image's white to the display's.
    observer : short name; the display is aimed for it if the configuration has such a version (`metamer display
        config`), else as usual (`aimed_for`). "" is the usual one.

    Raises
    ------
    InputError : an unreadable configuration, or one without the interchange role; an unusable profile
        (`read_display_profile`), or one together with a configuration.
    UnknownNameError : an unknown display or view; the message suggests the nearest names.
    """

    display: str = ""
    view: str = DEFAULT_VIEW
    config: str | None = None
    adaptation: Method = "Bradford"
    observer: str = ""
    # A rewritten profile is another display.
    _written: bytes | tuple[int, int] | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        if self.display.startswith(PREFIX):
            object.__setattr__(self, "_written", _written(self.display))
        if not self.display:
            object.__setattr__(self, "display", self._loaded.getDefaultDisplay())
        adaptation_matrix(DISPLAY_WHITE_XYZ, DISPLAY_WHITE_XYZ, self.adaptation)
        _ = self._cpu

    @cached_property
    def profile(self) -> DisplayProfile | None:
        """ICC profile of the display; None for a display of a configuration."""
        if self._written is None:
            return None
        if self.config:
            raise InputError(
                "an ICC profile and a configuration of OpenColorIO",
                field="display",
                found=f"{self.display} and {self.config}",
                expected="one of the two",
                hint="leave ocio_config out: a profile says itself what its display shows",
            )
        return _read_profile(self.display, self._written)

    @cached_property
    def name(self) -> str:
        """Name of the display, for users."""
        if self.profile is not None:
            return profile_config(self.profile)[1]
        aimed = name_for(self.display, self.observer)
        return aimed if self.observer and list(self._loaded.getViews(aimed)) else self.display

    @cached_property
    def aimed_for(self) -> str:
        """Short name of the observer that the display is aimed for; that of 1931 for standards and profiles."""
        space = self._config.getColorSpace(self._space)
        return described_observer("" if space is None else space.getDescription())

    @property
    def _space(self) -> str:
        """Name of the colour space of the display."""
        name = self._config.getDisplayViewColorSpaceName(self.name, self.view)
        return self.name if name == "<USE_DISPLAY_NAME>" else name

    @cached_property
    def config_name(self) -> str:
        """Name or path of the configuration in use."""
        if self.profile:
            return PINNED_CONFIG
        return self.config or os.environ.get("OCIO") or PINNED_CONFIG

    @cached_property
    def _named_by(self) -> str:
        if self.profile:
            return str(self.profile.path)
        if self.config:
            return f"configuration {self.config}"
        return f"$OCIO={os.environ['OCIO']}" if os.environ.get("OCIO") else f"configuration {PINNED_CONFIG}"

    @cached_property
    def _loaded(self) -> Any:
        """Loaded configuration."""
        import PyOpenColorIO as ocio

        try:
            config = profile_config(self.profile)[0] if self.profile else ocio.Config.CreateFromFile(self.config_name)
        except (ocio.Exception, ocio.ExceptionMissingFile) as reason:
            raise InputError(
                "the OpenColorIO configuration cannot be used",
                file=self._named_by,
                found=str(reason).strip(),
                expected="a configuration that OpenColorIO can load",
                hint=f"correct the file, or unset OCIO to use {PINNED_CONFIG}",
            ) from None
        if not config.hasRole(INTERCHANGE_ROLE):
            raise InputError(
                "the OpenColorIO configuration does not say which of its spaces is CIE XYZ (D65)",
                file=self._named_by,
                field="roles",
                found=", ".join(name for name, _ in config.getRoles()) or "no roles",
                expected=f"the role {INTERCHANGE_ROLE}",
                hint=f"add `{INTERCHANGE_ROLE}: <its XYZ-D65 display space>` to its roles, or unset OCIO",
            )
        return config

    @cached_property
    def _config(self) -> Any:
        config = self._loaded
        displays = list(config.getDisplays())
        if self.display not in displays and self.profile is None:
            raise UnknownNameError("display", self.display, displays, file=self._named_by, field="display")
        views = list(config.getViews(self.name))
        if self.view not in views:
            raise UnknownNameError("view", self.view, views, file=self._named_by, field=self.display)
        return config

    @cached_property
    def processor(self) -> Any:
        """OCIO processor from XYZ-D65 to display codes, for CPU and GPU."""
        return self._processor(back=False)

    @cached_property
    def inverse(self) -> Any:
        """OCIO processor from display codes to XYZ-D65.

        Raises
        ------
        InputError : the transform cannot be turned round.
        """
        return self._processor(back=True)

    def _processor(self, back: bool) -> Any:
        import PyOpenColorIO as ocio

        direction = ocio.TRANSFORM_DIR_INVERSE if back else ocio.TRANSFORM_DIR_FORWARD
        transform = ocio.DisplayViewTransform(
            src=INTERCHANGE_ROLE, display=self.name, view=self.view, direction=direction
        )
        try:
            return self._config.getProcessor(transform)
        except (ocio.Exception, ocio.ExceptionMissingFile) as reason:
            raise InputError(
                f"the display transform cannot be {'turned round' if back else 'built'}",
                file=self._named_by,
                field=f"{self.name} / {self.view}",
                found=str(reason).strip(),
                hint="check that every look-up table which the configuration names exists and can be read",
            ) from None

    @cached_property
    def _cpu(self) -> Any:
        return exact_on_cpu(self.processor)

    @cached_property
    def _cpu_back(self) -> Any:
        return exact_on_cpu(self.inverse)

    def apply(self, xyz_d65: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3"]:
        """Encode XYZ under the display's white; float32, not clipped."""
        values = np.array(xyz_d65, dtype=np.float32, order="C")
        self._cpu.applyRGB(values.reshape(-1, 3))
        return values

    def decode(self, rgb: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3"]:
        """Decode codes to XYZ under the display's white; float32.

        Raises
        ------
        InputError : the transform cannot be turned round.
        """
        values = np.array(rgb, dtype=np.float32, order="C")
        self._cpu_back.applyRGB(values.reshape(-1, 3))
        return values

    def adaptation_from(self, white_xyz: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
        """Return the adaptation matrix from XYZ under `white_xyz` to the display's white, for `xyz @ matrix.T`."""
        return adaptation_matrix(np.asarray(white_xyz, dtype=np.float64), DISPLAY_WHITE_XYZ, self.adaptation)

    def encode(
        self,
        image: ColourImage,
        coverage: Float[np.ndarray, "H W"] | None = None,
        background_xyz: Float[np.ndarray, "3"] | None = None,
        on: Callable[[np.ndarray], np.ndarray] | None = None,
    ) -> tuple[Float[np.ndarray, "H W 3"], tuple[str, ...]]:
        """Encode an image to display RGB in [0, 1], with notes.

        Parameters
        ----------
        image : relative XYZ (Y = 1: perfect diffuser) with the white it is seen under; "xyz_d65" is not adapted again.
        coverage : share of each pixel covered by the scene, 0 to 1; the image is premultiplied by it.
        background_xyz : background under the same white, composited by coverage in linear light.
        on : encoder of (H, W, 3) instead of `apply`, such as a `DisplayPass` on the GPU.

        Returns
        -------
        rgb : float32 (H, W, 3).
        notes : on clipped pixels with their share, and on invalid pixels; empty without any.
        """
        if background_xyz is not None and coverage is None:
            raise InputError("a background needs the picture's coverage", field="coverage", expected="an (H, W) array")
        xyz = np.asarray(image.values, dtype=np.float64)
        if background_xyz is not None and coverage is not None:
            xyz = composite(xyz, coverage, background_xyz)
        if image.space == "xyz":
            xyz = xyz @ self.adaptation_from(image.white_xyz).T
        xyz_d65 = xyz.astype(np.float32)
        undefined = ~np.isfinite(xyz_d65).all(axis=-1)
        xyz_d65[undefined] = 0.0
        rgb = (on or self.apply)(xyz_d65)
        undefined = np.logical_or(undefined, ~np.isfinite(rgb).all(axis=-1))
        below, above = self.out_of_range(xyz_d65, rgb)
        notes = _notes(below, above, below & self.darker_than_black(xyz_d65), undefined, self.name)
        rgb = np.clip(rgb, 0.0, 1.0)
        rgb[undefined] = NOT_A_NUMBER_RGB
        return rgb, notes

    def out_of_range(
        self, xyz_d65: Float[np.ndarray, "*batch 3"], rgb: Float[np.ndarray, "*batch 3"]
    ) -> tuple[Bool[np.ndarray, "*batch"], Bool[np.ndarray, "*batch"]]:
        """Return masks of colours that the display cannot show: with a channel below its range (out of gamut, or
        `darker_than_black`), and with one above (brighter than white).

        Tables of a profile limit codes to the gamut: there colours count that no code shows within ΔE94 1, by the
        tables from codes to colours, on the side of the range of their codes. Errors of the inverse tables are reported
        separately (`describe`).

        rgb : codes of `xyz_d65` from `apply`.
        """
        if self.profile is None or not self.profile.has_limits:
            low, high = rgb < -CLIP_TOLERANCE, rgb > 1.0 + CLIP_TOLERANCE
            return np.asarray(low.any(axis=-1)), np.asarray(high.any(axis=-1))
        off = np.asarray(self._table_error(xyz_d65, rgb) > _BEYOND)
        # Colours with large errors of the inverse tables are searched in the forward tables.
        doubtful = np.array(xyz_d65[off], dtype=np.float32, order="C")
        if len(doubtful):
            nearest = doubtful.copy()
            self._nearest.applyRGB(nearest)
            off[off] = self._table_error(doubtful, nearest) > _BEYOND
        above = np.asarray(off & (rgb >= 1.0 - _TABLE_STEP).any(axis=-1))
        return np.asarray(off & ~above), above

    def darker_than_black(self, xyz_d65: Float[np.ndarray, "*batch 3"]) -> Bool[np.ndarray, "*batch"]:
        """Return a mask of colours with less luminance than the display's black in this view, which are no gamut
        errors; all False if the transform is not invertible, or black has no luminance.
        """
        return np.asarray(np.asarray(xyz_d65)[..., 1] < self.black_y)

    @cached_property
    def black_y(self) -> float:
        """Luminance of the display's black in this view, white = 1; -inf if it is 0 or unknown."""
        try:
            y = float(self.decode(np.zeros((1, 3)))[0, 1])
        except InputError:
            return -np.inf
        return y if y > _NO_LIGHT else -np.inf

    def _table_error(self, xyz_d65: np.ndarray, rgb: np.ndarray) -> np.ndarray:
        """Compute ΔE94 between XYZ and the colours of codes, by the profile's tables."""
        shown = self.decode(np.clip(rgb, 0.0, 1.0)).astype(np.float64)
        return np.asarray(delta_e_xyz(np.asarray(xyz_d65, dtype=np.float64), shown, DISPLAY_WHITE_XYZ))

    @cached_property
    def _nearest(self) -> Any:
        """OCIO processor to the nearest codes for XYZ-D65, by the profile's forward tables."""
        import PyOpenColorIO as ocio

        assert self.profile is not None
        back = ocio.TRANSFORM_DIR_INVERSE
        return exact_on_cpu(ocio.Config.CreateRaw().getProcessor(self.profile.to_xyz_d65, back))

    def clips_all(self, image: ColourImage, coverage: Float[np.ndarray, "H W"]) -> bool:
        """Return whether every covered pixel of an image is brighter than the display's maximum.

        A view that limits values itself never clips.
        """
        covered = np.asarray(coverage) > 0.0
        if not covered.any():
            return False
        xyz = (
            np.asarray(image.values, dtype=np.float64)[covered] / np.asarray(coverage, dtype=np.float64)[covered, None]
        )
        if image.space == "xyz":
            xyz = xyz @ self.adaptation_from(image.white_xyz).T
        return bool(self.out_of_range(xyz, self.apply(xyz))[1].all())

    @cached_property
    def white_shift(self) -> float:
        """ΔE94 by which the view changes white; NaN if the result is invalid."""
        white = self.shown(self.apply(DISPLAY_WHITE_XYZ))
        return float(delta_e_xyz(DISPLAY_WHITE_XYZ, white, DISPLAY_WHITE_XYZ))

    @property
    def is_colorimetric(self) -> bool:
        """True if the view preserves white."""
        return self.white_shift <= WHITE_TOLERANCE

    @cached_property
    def shows_limits(self) -> bool:
        """True if codes beyond the display's range are preserved: the view neither limits nor changes white."""
        return self.is_colorimetric and not self._limits_itself

    @cached_property
    def _limits_itself(self) -> bool:
        """True if a view compresses colours brighter than white into its range; False for displays with headroom above
        white.
        """
        bright = _BRIGHT * DISPLAY_WHITE_XYZ[None]
        rgb = self.apply(bright)
        return not (self.out_of_range(bright, rgb)[1][0] or np.allclose(self.shown(rgb), bright, rtol=_SAME))

    def describe(self) -> list[str]:
        """Describe the chain for a report; the change of white is measured, not quoted."""

        white = self.apply(DISPLAY_WHITE_XYZ)
        code = ", ".join(f"{value:.4f}" for value in white)
        x, y = DISPLAY_WHITE_XYZ[:2] / DISPLAY_WHITE_XYZ.sum()
        words = [
            f"Chromatic adaptation: {self.adaptation}, once, from the white of each light to the display white D65 "
            f"(x {x:.4f}, y {y:.4f}), before OpenColorIO.",
            *self._chain(),
            *self._aim_words(),
            f"The perfect diffuser facing the light (Y = 1) is sent to the display as ({code}).",
        ]
        if self.profile is not None and self.profile.has_limits:
            steps = np.linspace(0.0, 1.0, 9, dtype=np.float32)
            codes = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
            xyz = self.decode(codes)
            apart = self._table_error(xyz, self.apply(xyz))
            words.append(
                f"The profile's tables to codes miss its own colours by ΔE94 {apart.mean():.2f} on average, "
                f"{apart.max():.1f} at most, within the gamut, at which they end: pixels beyond that no code shows to "
                f"within ΔE94 {_BEYOND:g} are counted per picture."
            )
        elif self._limits_itself:
            words.append("This view limits values above white itself: clipped pixels cannot all be counted.")
        else:
            words.append("No tone mapping by Metamer: what the display cannot show is clipped and counted per picture.")
        if not self.is_colorimetric:
            words.append(
                f"This view changes white, by ΔE94 {self.white_shift:.1f}: it is not colorimetric, and pictures do not "
                "show colours as computed."
            )
        elif white.min() < 1.0 - 2e-3:
            words.append("These codes show the white that was asked for: full code is not white on this display.")
        return words

    def _aim_words(self) -> list[str]:
        if self.observer and observer_name(self.observer) != self.aimed_for:
            aimed, seen_by = observer(self.aimed_for).name, observer(self.observer).name
            return [
                f"The display is still aimed for the {aimed}, while pictures are for the {seen_by}: to that observer "
                "it shows other colours than they have."
            ]
        described = self._config.getColorSpace(self._space).getDescription()
        return [f"{described}."] if self.name != self.display and self.profile is None else []

    def _chain(self) -> list[str]:
        import PyOpenColorIO as ocio

        if self.profile is not None:
            first, *more = self.profile.describe()
            return [f"Display transform: OpenColorIO {ocio.__version__}, {first}", *more]
        return [
            f"Display transform: OpenColorIO {ocio.__version__}, {self._named_by}, display “{self.name}”, "
            f"view “{self.view}”, entered through the role {INTERCHANGE_ROLE}."
        ]

    def shown(self, rgb: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3"]:
        """Return the displayed XYZ-D65 of codes, by the configuration's colour space; codes are clipped to [0, 1].

        Raises
        ------
        InputError : a configuration without a transform from codes to colours.
        """
        import PyOpenColorIO as ocio

        name = self._space
        values = np.clip(np.array(rgb, dtype=np.float32, order="C"), 0.0, 1.0)
        try:
            processor = self._config.getProcessor(name, INTERCHANGE_ROLE).getDefaultCPUProcessor()
        except (ocio.Exception, ocio.ExceptionMissingFile) as reason:
            raise InputError(
                "what codes show is not known",
                file=self._named_by,
                field=name,
                found=str(reason).strip(),
                expected="a display colour space that can be inverted",
            ) from None
        processor.applyRGB(values.reshape(-1, 3))
        return values


def _written(display: str) -> bytes | tuple[int, int]:
    """Return the state of a profile for detecting changes: the screen's bytes, or time and size of a file."""
    if display == SCREEN:
        return screen_profile()
    seen = existing_file(display.removeprefix(PREFIX)).stat()
    return seen.st_mtime_ns, seen.st_size


@lru_cache(maxsize=8)
def _read_profile(display: str, written: bytes | tuple[int, int]) -> DisplayProfile:
    """Read the profile of a display name, cached by its state."""
    if isinstance(written, bytes):
        return read_display_profile(display, written)
    return read_display_profile(existing_file(display.removeprefix(PREFIX)))


def composite(
    xyz: Float[np.ndarray, "H W 3"],
    coverage: Float[np.ndarray, "H W"],
    background_xyz: Float[np.ndarray, "3"],
) -> Float[np.ndarray, "H W 3"]:
    """Composite an image, premultiplied by its coverage, over a uniform background in linear light."""
    behind = 1.0 - np.asarray(coverage, dtype=np.float64)[..., None]
    return np.asarray(xyz, dtype=np.float64) + behind * np.asarray(background_xyz, dtype=np.float64)


def _notes(
    below: Bool[np.ndarray, "H W"],
    above: Bool[np.ndarray, "H W"],
    darker: Bool[np.ndarray, "H W"],
    undefined: Bool[np.ndarray, "H W"],
    display: str,
) -> tuple[str, ...]:
    notes = []
    total = undefined.size
    over, under = above & ~undefined, below & ~undefined
    clipped = int(np.count_nonzero(over | under))
    if clipped:
        sides = [
            (over, "above its range (brighter than white in a channel)"),
            (under & ~darker, "below it (outside its gamut)"),
            (under & darker, "darker than its black"),
        ]
        counted = " and ".join(f"{np.count_nonzero(side)} {words}" for side, words in sides if side.any())
        notes.append(f"{clipped} of {total} pixels ({clipped / total:.2%}) clipped to “{display}”: {counted}.")
    missing = int(np.count_nonzero(undefined))
    if missing:
        notes.append(f"{missing} of {total} pixels ({missing / total:.2%}) hold no number and are shown in magenta.")
    return tuple(notes)
