"""Interreflection at sites while materials, lights and views change: all that is precomputed is geometry.

    1. What sites receive of the lights straight away (`direct_irradiance`).
    2. What they send out of it: matt ones evenly, glossy ones by their BRDF, towards rays that meet them
    (`first_bounce`). 3. What arrives of that, and what is passed on until nothing can be seen (`bounces`). From the
    second surface on,
       glossy parts pass light on as matt ones that reflect as much.
    4. Towards a viewer, matt sites fold what arrives; glossy ones sum up, over their own rays, what each brings times
       the BRDF (`final_gather`).

Between surfaces light is J coefficients relative to the spectrum of its light (`transport_basis`). At the surface that
is seen, the reflectance meets light and observer at all wavelengths: coefficient j of spectrum k is a light s_k b_j of
its own. Where some part fluoresces, coefficients are of the radiance of all lights together (`coefficients`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from ....lighting.camera import Camera
from ....lighting.lights import Light
from ....lighting.scene import Scene
from ....lighting.transfer.bounces import ENOUGH, MOST, Interreflection, passed_on
from ....lighting.transfer.coefficients import Coefficients
from ....lighting.transfer.direct_irradiance import Received, received
from ....lighting.transfer.first_bounce import CellLight, cell_radiosity, ray_radiosity
from ....lighting.transfer.glossy_rays import GlossyRays
from ....lighting.transfer.precomputation import Precomputation
from ....lighting.transfer.radiant import planned_basis
from ....lighting.transfer.reflection import Reflection
from ....lighting.transfer.regions import RadiantRegions, Regions
from ....lighting.vectors import VectorLike, finite_vector
from ....materials.core.surface import Surface
from ....runtime.errors import InputError
from ....spectral.basis import SpectralBasis
from ....spectral.bispectral import Bispectral
from ....spectral.spectrum import Spectrum
from ....spectral.wavelengths import common_wavelengths
from .extrapolation import settled
from .final_gather import GatherSources, SeenTexels, glossy_exits
from .transport_basis import transport_basis


@dataclass(frozen=True, eq=False)
class Relighting:
    """A scene whose parts light each other, in one state of materials and lights.

    Other states share what they have in common with it: geometry, and what lights give sites; materials; the basis,
    unless a material or a light has spectra that it was not made for.

    prepared : its geometry. reflections : of each part. lights : of which K spectra arrive, one after the other.
    basis : of J coefficients; together they are F fields (`Coefficients`). bounces : surfaces that light meets before
    the one that is seen; None is as many as change it by ΔE94 `enough`. dtype : that coefficients are summed up in.
    """

    prepared: Precomputation
    reflections: tuple[Reflection, ...]
    lights: tuple[Light, ...]
    basis: SpectralBasis
    bounces: int | None = None
    enough: float = ENOUGH
    dtype: type = np.float32
    _received: Received | None = None
    _seen: SeenTexels = field(default_factory=SeenTexels, repr=False)

    @classmethod
    def of(
        cls,
        scene: Scene,
        surfaces: Mapping[str, Surface],
        prepared: Precomputation | None = None,
        basis: SpectralBasis | None = None,
        bounces: int | None = None,
        enough: float = ENOUGH,
        dtype: type = np.float32,
    ) -> Relighting:
        """surfaces : by material id. basis : None plans one for these materials and lights.

        Raises
        ------
        InputError : the geometry does not fit into memory; a glossy material that fluoresces; bounces below 0.
        """
        scene.check_surfaces(surfaces)
        if bounces is not None and bounces < 0:
            raise InputError("less than no bounce", field="bounces", found=bounces, expected="0 or more")
        known = Precomputation.of(scene) if prepared is None else prepared
        # Ids of one surface share what is found of it.
        names = {id(surfaces[name]): name for name in scene.material_ids}
        found = {key: Reflection.of(surfaces[name], known.cells, name) for key, name in names.items()}
        reflections = tuple(found[id(surfaces[part.material])] for part in scene.parts)
        planned = _planned(known.scene, reflections, scene.lights) if basis is None else basis
        return cls(known, reflections, scene.lights, planned, bounces, enough, dtype)

    def with_material(self, part: str, surface: Surface, basis: SpectralBasis | None = None) -> Relighting:
        """Put another material on one part. basis : None plans anew, where the one that there is does not fit.

        Raises
        ------
        UnknownNameError : no such part. InputError : it is static; what `of` raises.
        """
        self.prepared.scene.check_changes(part)
        number = [one.name for one in self.prepared.scene.parts].index(part)
        found = list(self.reflections)
        found[number] = Reflection.of(surface, self.prepared.cells, part)
        planned = _planned(self.prepared.scene, found, self.lights, self.basis) if basis is None else basis
        same = found[number].is_matt == self.reflections[number].is_matt
        # Direct irradiance depends only on which sites are glossy.
        got = self.__dict__.get("received", self._received) if same else None
        return replace(self, reflections=tuple(found), basis=planned, _received=got)

    def with_lights(self, *lights: Light, basis: SpectralBasis | None = None) -> Relighting:
        """Replace the lights. basis : None plans anew, where the one that there is does not fit."""
        seen = tuple(light.for_observer(self.prepared.scene.observer) for light in lights)
        if not seen:
            raise InputError("a scene without lights", field="lights", found=0, expected="at least one")
        spectra = [spectrum for light in self.lights for spectrum in light.spectra]
        known = all(any(one is other for other in spectra) for light in seen for one in light.spectra)
        if basis is None:
            basis = self.basis if known else _planned(self.prepared.scene, self.reflections, seen, self.basis)
        return replace(self, lights=seen, basis=basis, _received=None)

    def lit_by(self, illuminant: Spectrum | None) -> Relighting:
        """Replace the spectra of all lights; None leaves them as they are."""
        if illuminant is None:
            return self
        return self.with_lights(*(light.with_spectrum(illuminant) for light in self.lights))

    def excited(self, illuminants: Sequence[Spectrum | None]) -> list[Relighting]:
        """Return a state for each of them where something fluoresces, which each excites anew; none where folds do."""
        own = all(one is None for one in illuminants)
        return [] if own or not self.coefficients.radiant else [self.lit_by(one) for one in illuminants]

    @cached_property
    def coefficients(self) -> Coefficients:
        """Coefficients of light between surfaces."""
        scene = self.prepared.scene
        reference, radiant = float(scene.viewing.reference_illuminance_lux), _fluoresces(self.reflections)
        spectra = tuple(spectrum for light in self.lights for spectrum in light.spectra)
        return Coefficients(self.basis, spectra, scene.observer, reference, radiant)

    @property
    def spectra(self) -> tuple[Spectrum, ...]:
        """K, of all lights."""
        return self.coefficients.spectra

    @cached_property
    def glossy(self) -> Bool[np.ndarray, " P"]:
        """Parts that are glossy."""
        return np.array([not one.is_matt for one in self.reflections])

    @property
    def rays(self) -> GlossyRays:
        """Rays of and to glossy parts."""
        return self.prepared.glossy_rays(self.glossy)

    @cached_property
    def received(self) -> Received:
        """Direct irradiance of the lights."""
        return received(self.prepared, self.rays, self.lights) if self._received is None else self._received

    @cached_property
    def _matt(self) -> Float[np.ndarray, "S F"]:
        """Light that sites send out evenly of what they receive of lights."""
        part, lux = self.prepared.hits.part_of_site, self.received.lux.T
        each = [one[:, None] * terms[part] for one, terms in zip(lux, self._terms, strict=True)]
        return self.coefficients.joined(each).astype(self.dtype, copy=False)

    @cached_property
    def _terms(self) -> list[Float[np.ndarray, "P J"]]:
        """Light that each part sends out evenly of 1 lux of each spectrum."""
        return self._sent_by_parts(np.stack([one.matt for one in self._fitting]))

    def _sent_by_parts(self, reflected: Float[np.ndarray, "P L"]) -> list[Float[np.ndarray, "P J"]]:
        """Return the same of parts that reflect this, and glow besides."""
        found = [one.astype(self.dtype) for one in self.coefficients.sent(reflected)]
        for glow, parts in self._glowing.items():
            for one, sent in zip(found, self.coefficients.glowing(glow), strict=True):
                one[parts] = sent
        return found

    @cached_property
    def _glowing(self) -> dict[Bispectral, list[int]]:
        """The parts that wear each fluorescent surface."""
        found: dict[Bispectral, list[int]] = {}
        for number, one in enumerate(self.reflections):
            if one.glow is not None:
                found.setdefault(one.glow, []).append(number)
        return found

    @cached_property
    def _fitting(self) -> tuple[Reflection, ...]:
        """Reflections at the wavelengths of the basis."""
        return tuple(one.on(self.basis.wavelengths_nm) for one in self.reflections)

    @cached_property
    def _cells(self) -> tuple[CellLight, ...]:
        """Light that glossy sites send into cells, of lights that spread."""
        return cell_radiosity(self.rays, self.reflections, self._fitting, self.received, self.coefficients, self.dtype)

    @cached_property
    def _ends(self) -> Float[np.ndarray, "n F"]:
        """Light that rays that end on glossy parts bring, of lights from one direction."""
        return ray_radiosity(self.prepared, self.rays, self._fitting, self.received, self.coefficients, self.dtype)

    @cached_property
    def _first(self) -> Float[np.ndarray, "S F"]:
        """Irradiance of light that met one surface."""
        rays, count = self.rays, len(self.prepared.hits.sites)
        amounts = self.received.amounts
        arriving = self.coefficients.joined(self.prepared.by_part.irradiance(amounts, self._terms))
        for one in self._cells:
            arriving[one.part.rows] += one.irradiance
        if self.received.free and len(rays.ray):
            row = rays.ray // rays.rays
            for column in range(arriving.shape[1]):
                arriving[:, column] += np.bincount(row, self._ends[:, column], count) / rays.rays
        return arriving

    @cached_property
    def passed(self) -> Interreflection:
        """Light that sites pass on of it, every part as a matt one; `left` and `bound` are those of the whole."""
        scene = self.prepared.scene
        albedos = np.stack([one.albedo for one in self._fitting])
        regions, coefficients = self._regions(albedos), self.coefficients
        first = regions.reflected(self._by_kind(self._first))
        to_xyz, white = coefficients.to_xyz.astype(self.dtype), scene.adopted_white()
        beside, later = self._direct_colours(to_xyz, albedos), self.prepared.later
        if self.bounces is None:
            return settled(later, regions, first, to_xyz, coefficients.most_y, white, self.enough, MOST, beside)
        more, reference = max(self.bounces - 2, 0), coefficients.reference_lux
        return passed_on(later, regions, first, to_xyz, white, reference, self.enough, MOST, None, beside, more)

    def _regions(self, albedos: Float[np.ndarray, "P L"]) -> Regions | RadiantRegions:
        part, coefficients = self.prepared.hits.part_of_site, self.coefficients
        if not coefficients.radiant:
            return Regions(part, albedos, self.basis)
        # Parts of one surface share its matrix.
        known = {id(one): one.bispectral for one in self.reflections}
        number = np.array([[*known].index(id(one)) for one in self.reflections])
        surfaces = tuple(known.values())
        return RadiantRegions(number[part], surfaces, coefficients.spectra, coefficients.observer, self.basis)

    def _direct_colours(
        self, to_xyz: Float[np.ndarray, "F 3"], albedos: Float[np.ndarray, "P L"]
    ) -> Float[np.ndarray, "S 3"]:
        """Compute the colours that sites send out of what lights give them, every part as a matt one."""
        sent, part = self._sent_by_parts(albedos), self.prepared.hits.part_of_site
        kinds = to_xyz.reshape(self.coefficients.kinds, self.basis.size, 3)
        of_parts = np.stack([one @ kinds[k % len(kinds)] for k, one in enumerate(sent)], axis=1)
        return np.einsum("sk,skc->sc", self.received.lux, of_parts[part])

    @cached_property
    def _sent(self) -> Float[np.ndarray, "S F"]:
        """Light that sites send out evenly, of all the light that others are to receive."""
        if self.bounces is not None and self.bounces < 2:
            return self._matt
        return self._matt + self.passed.all.reshape(len(self._matt), -1).astype(self.dtype)

    @cached_property
    def arriving(self) -> Float[np.ndarray, "S kinds J"]:
        """Irradiance that other parts give each site, by coefficients: of each of K spectra, or of all together where
        some part fluoresces (`Coefficients.kinds`).

        Both sides of sheets have sites: see `prepared.hits` for which those of a triangle are.
        """
        if self.bounces == 0:
            found = np.zeros_like(self._matt)
        elif self.bounces == 1:
            found = self._first
        else:
            passed = self.passed.all.reshape(len(self._first), -1).astype(self.dtype)
            found = self._first + self.prepared.operator @ passed
        return self._by_kind(found)

    def _by_kind(self, flat: Float[np.ndarray, "S F"]) -> Float[np.ndarray, "S kinds J"]:
        return flat.reshape(len(flat), self.coefficients.kinds, self.basis.size)

    def exits(
        self, eye: VectorLike | Camera, illuminants: Sequence[Spectrum | None] = (None,)
    ) -> Float[np.ndarray, "S M3"]:
        """(S,3M) XYZ that each site sends towards a place, or a camera, of what other parts give it, without what
        lights give it straight away; 0 where no triangle about it looks there.
        """
        if each := self.excited(illuminants):
            return np.concatenate([one.exits(eye) for one in each], axis=1)
        prepared, part = self.prepared, self.prepared.hits.part_of_site

        def towards(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
            return eye.to_viewer(points) if isinstance(eye, Camera) else finite_vector(eye, "eye") - points

        seen = prepared.seen(towards)
        arriving = self.arriving.reshape(len(part), -1)
        found = np.zeros((len(part), 3 * len(illuminants)), dtype=self.dtype)
        for number in range(len(self.reflections)):
            mine = np.flatnonzero((part == number) & seen)
            found[mine] = arriving[mine] @ self.matt_fold(number, illuminants).astype(self.dtype)
        if self.bounces == 0 or not self.glossy.any():
            return found
        folds = [self.glossy_fold(number, illuminants) if glossy else None for number, glossy in enumerate(self.glossy)]
        centre, radius = prepared.centre_and_radius
        to = towards(prepared.hits.sites.starts * radius + centre)
        glossy_exits(found, prepared, self.rays, self.reflections, folds, self.sources, to, seen, self._seen)
        return found

    @cached_property
    def sources(self) -> GatherSources:
        """Light along the rays of glossy sites."""
        return GatherSources(self.rays, self._sent, self._cells, self._ends if self.received.free else None)

    def matt_fold(self, part: int, illuminants: Sequence[Spectrum | None] = (None,)) -> Float[np.ndarray, "F M3"]:
        """Map arriving coefficients to the diffuse light that a part sends out, see `Coefficients.folds`."""
        one = self._fitting[part]
        if one.glow is not None:
            return self.coefficients.glowing_fold(one.glow, illuminants)
        return self.coefficients.folds(one.matt, illuminants)

    def glossy_fold(self, part: int, illuminants: Sequence[Spectrum | None] = (None,)) -> Float[np.ndarray, "R F M3"]:
        """Return the same of its other terms."""
        return self.coefficients.folds(self._fitting[part].spectra, illuminants)


def _planned(
    scene: Scene, reflections: Sequence[Reflection], lights: Sequence[Light], before: SpectralBasis | None = None
) -> SpectralBasis:
    """Return a basis for all that light may meet: the one that was there before, where it is good for that."""
    lamps = [spectrum for light in lights for spectrum in light.spectra]
    if _fluoresces(reflections):
        each = {id(one): one for one in reflections}.values()
        return planned_basis([seen for one in each for seen in one.shown_as_matrices], lamps, scene.observer, before)
    wavelengths = common_wavelengths([one.wavelengths_nm for one in reflections])
    spectra = np.concatenate([one.on(wavelengths).shown for one in reflections])
    return transport_basis(spectra, lamps, scene.observer, wavelengths, before=before)


def _fluoresces(reflections: Sequence[Reflection]) -> bool:
    return any(one.glow is not None for one in reflections)
