"""How far a fast form is from what it stands for, as it was measured."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class LightError:
    """ΔE94 over the samples of a protocol under one light; `highlight`: p99 of the highlight's own pixels, if any."""

    light: str
    mean: float
    p95: float
    p99: float
    maximum: float
    highlight: float | None = None


@dataclass(frozen=True)
class FitError:
    """Measured error of a fast form against the surface that it stands for.

    mean, p95, p99, maximum : ΔE94 over the samples of `protocol`, under `light`, the worst of those judged, for
    `observer`; reference = the original at every wavelength. relative_error : root of the sum of squares of the tables'
    residuals over that of the tables, weighted by what is seen. most_negative : lowest f_r cos(theta_i) pi that the
    packs shade to at any wavelength, all over the hemispheres (0 where none is negative; a white diffuser facing the
    light is 1). largest : their largest, over the original's largest anywhere at the same wavelength; None where nobody
    looked. Nothing is clipped. lights : the figures of every light judged, the worst included; empty where there was
    one.
    """

    mean: float
    p95: float
    p99: float
    maximum: float
    light: str
    observer: str
    protocol: str
    relative_error: float
    most_negative: float = 0.0
    largest: float | None = None
    lights: tuple[LightError, ...] = ()

    @property
    def highlight(self) -> float | None:
        """The worst p99 of the highlight's own pixels under any light; None where the surface has no highlight."""
        return max((one.highlight for one in self.lights if one.highlight is not None), default=None)
