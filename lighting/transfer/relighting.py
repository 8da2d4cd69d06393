"""Interreflection at sites while materials, lights and views change: all that is precomputed is geometry.

    1. What sites receive of the lights straight away (`received`).
    2. What they send out of it: matt ones evenly, glossy ones by their BRDF, towards rays that meet them (`emission`).
    3. What arrives of that, and what is passed on until nothing can be seen (`bounces`). From the second surface on,
       glossy parts pass light on as matt ones that reflect as much.
    4. Towards a viewer, matt sites fold what arrives; glossy ones sum up, over their own rays, what each brings times
       the BRDF (`exits`).

Between surfaces light is J coefficients relative to the spectrum of its light (`transport_basis`). At the surface that
is seen, the reflectance meets light and observer at all wavelengths: coefficient j of spectrum k is a light s_k b_j of
its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from ...materials.surface import Surface
from ...spectral.basis import SpectralBasis
from ...spectral.errors import InputError
from ...spectral.spectrum import Spectrum
from ...spectral.wavelengths import common_wavelengths, interpolation_matrix
from ..camera import Camera
from ..lights import Light
from ..scene import Scene
from ..vectors import VectorLike, finite_vector, unit
from .bounces import ENOUGH, MOST, Interreflection, Regions, passed_on
from .emission import CellLight, cell_radiosity, ray_radiosity
from .exits import BEYOND, Seen, Sources, glossy_exits
from .glossy_rays import GlossyRays
from .prepared import Prepared
from .received import Received, received
from .reflection import Reflection
from .settling import settled
from .transport_basis import transport_basis


@dataclass(frozen=True, eq=False)
class Relighting:
    """A scene whose parts light each other, in one state of materials and lights.

    Other states share what they have in common with it: geometry, and what lights give sites; materials; the basis,
    unless a material or a light has spectra that it was not made for.

    prepared : its geometry. reflections : of each part. lights : of which K spectra arrive, one after the other.
    basis : of J coefficients. bounces : surfaces that light meets before the one that is seen; None is as many as
    change it by ΔE94 `enough`. dtype : that coefficients are summed up in.
    """

    prepared: Prepared
    reflections: tuple[Reflection, ...]
    lights: tuple[Light, ...]
    basis: SpectralBasis
    bounces: int | None = None
    enough: float = ENOUGH
    dtype: type = np.float32
    _received: Received | None = None
    _weights: dict[tuple[int, bytes], tuple[Spectrum, np.ndarray]] = field(default_factory=dict, repr=False)
    _seen: Seen = field(default_factory=Seen, repr=False)

    @classmethod
    def of(
        cls,
        scene: Scene,
        surfaces: Mapping[str, Surface],
        prepared: Prepared | None = None,
        basis: SpectralBasis | None = None,
        bounces: int | None = None,
        enough: float = ENOUGH,
        dtype: type = np.float32,
    ) -> Relighting:
        """surfaces : by material id. basis : None plans one for these materials and lights.

        Raises
        ------
        InputError : the geometry does not fit into memory; a fluorescent material; bounces below 0.
        """
        scene.check_surfaces(surfaces)
        if bounces is not None and bounces < 0:
            raise InputError("less than no bounce", field="bounces", found=bounces, expected="0 or more")
        known = Prepared.of(scene) if prepared is None else prepared
        # Ids of one surface share what is found of it.
        names = {id(surfaces[name]): name for name in scene.material_ids}
        found = {key: Reflection.of(surfaces[name], known.cells, name) for key, name in names.items()}
        reflections = tuple(found[id(surfaces[part.material])] for part in scene.parts)
        planned = _planned(known.scene, reflections, scene.lights) if basis is None else basis
        return cls(known, reflections, scene.lights, planned, bounces, enough, dtype)

    def with_material(self, part: str, surface: Surface, basis: SpectralBasis | None = None) -> Relighting:
        """With another material on one part. basis : None plans anew, where the one that there is does not fit."""
        names = [one.name for one in self.prepared.scene.parts]
        number = names.index(self.prepared.scene.part(part).name)
        found = list(self.reflections)
        found[number] = Reflection.of(surface, self.prepared.cells, part)
        planned = _planned(self.prepared.scene, found, self.lights, self.basis) if basis is None else basis
        same = found[number].is_matt == self.reflections[number].is_matt
        # What lights give is known by which sites are glossy.
        got = self.__dict__.get("received", self._received) if same else None
        return replace(self, reflections=tuple(found), basis=planned, _received=got)

    def with_lights(self, *lights: Light, basis: SpectralBasis | None = None) -> Relighting:
        """With other lights. basis : None plans anew, where the one that there is does not fit."""
        seen = tuple(light.for_observer(self.prepared.scene.observer) for light in lights)
        if not seen:
            raise InputError("a scene without lights", field="lights", found=0, expected="at least one")
        spectra = [spectrum for light in self.lights for spectrum in light.spectra]
        known = all(any(one is other for other in spectra) for light in seen for one in light.spectra)
        if basis is None:
            basis = self.basis if known else _planned(self.prepared.scene, self.reflections, seen, self.basis)
        return replace(self, lights=seen, basis=basis, _received=None)

    @property
    def spectra(self) -> tuple[Spectrum, ...]:
        """K, of all lights."""
        return tuple(spectrum for light in self.lights for spectrum in light.spectra)

    @cached_property
    def glossy(self) -> Bool[np.ndarray, " P"]:
        """Which parts are."""
        return np.array([not one.is_matt for one in self.reflections])

    @property
    def rays(self) -> GlossyRays:
        """Those that glossy parts have to do with."""
        return self.prepared.glossy_rays(self.glossy)

    @cached_property
    def received(self) -> Received:
        """What lights give straight away."""
        return received(self.prepared, self.rays, self.lights) if self._received is None else self._received

    @cached_property
    def _matt(self) -> Float[np.ndarray, "S KJ"]:
        """What sites send out evenly of it."""
        part = self.prepared.hits.part_of_site
        sent = self.received.lux[:, :, None] * self._terms[part][:, None, :]
        return sent.reshape(len(sent), -1).astype(self.dtype, copy=False)

    @cached_property
    def _terms(self) -> Float[np.ndarray, "P J"]:
        """Of what each part reflects evenly."""
        return self.basis.project(np.stack([self._on_basis(one, one.matt) for one in self.reflections])).astype(
            self.dtype
        )

    @cached_property
    def _fitting(self) -> tuple[Reflection, ...]:
        """Reflections at the wavelengths of the basis."""
        return tuple(
            replace(one, spectra=self._on_basis(one, one.spectra), wavelengths_nm=self.basis.wavelengths_nm)
            for one in self.reflections
        )

    def _on_basis(self, one: Reflection, values: Float[np.ndarray, "*n L"]) -> Float[np.ndarray, "*n L"]:
        to = self.basis.wavelengths_nm
        if np.array_equal(one.wavelengths_nm, to):
            return values
        return values @ interpolation_matrix(one.wavelengths_nm, to).T

    @cached_property
    def _cells(self) -> tuple[CellLight, ...]:
        """What glossy sites send into cells, of lights that spread."""
        return cell_radiosity(self.rays, self.reflections, self._fitting, self.received, self.basis, self.dtype)

    @cached_property
    def _ends(self) -> Float[np.ndarray, "n KJ"]:
        """What rays that end on glossy parts bring, of lights from one direction."""
        return ray_radiosity(self.prepared, self.rays, self._fitting, self.received, self.basis, self.dtype)

    @cached_property
    def _first(self) -> Float[np.ndarray, "S KJ"]:
        """Irradiance of light that met one surface."""
        rays, count = self.rays, len(self.prepared.hits.sites)
        arriving = self.prepared.by_part.irradiance(self.received.amounts, self._terms)
        for one in self._cells:
            arriving[one.part.rows] += (one.part.emission @ one.values) @ one.spread
        if self.received.free and len(rays.ray):
            row = rays.ray // rays.rays
            for column in range(arriving.shape[1]):
                arriving[:, column] += np.bincount(row, self._ends[:, column], count) / rays.rays
        return arriving

    @cached_property
    def passed(self) -> Interreflection:
        """What sites send on of it, every part as a matt one; `left` and `bound` are those of the whole."""
        scene = self.prepared.scene
        albedos = np.stack([self._on_basis(one, one.albedo) for one in self.reflections])
        part = self.prepared.hits.part_of_site
        regions = Regions(part, albedos, self.basis)
        first = regions.reflected(self._by_spectrum(self._first))
        reference = float(scene.viewing.reference_illuminance_lux)
        weights = [self._observed(spectrum) for spectrum in self.spectra]
        to_xyz = (np.concatenate([self.basis.synthesis.T @ one.T for one in weights]) / reference).astype(self.dtype)
        beside, later = self._direct_colours(to_xyz, albedos), self.prepared.later
        white = scene.adopted_white()
        if self.bounces is None:
            return settled(later, regions, first, weights, white, reference, self.enough, MOST, beside)
        more = max(self.bounces - 2, 0)
        return passed_on(later, regions, first, to_xyz, white, reference, self.enough, MOST, None, beside, more)

    def _direct_colours(
        self, to_xyz: Float[np.ndarray, "KJ 3"], albedos: Float[np.ndarray, "P L"]
    ) -> Float[np.ndarray, "S 3"]:
        """What sites send out of what lights give them, every part as a matt one."""
        folds = to_xyz.reshape(len(self.spectra), self.basis.size, 3)
        of_parts = np.einsum("pj,kjc->pkc", self.basis.project(albedos), folds).astype(self.dtype)
        return np.einsum("sk,skc->sc", self.received.lux, of_parts[self.prepared.hits.part_of_site])

    @cached_property
    def _sent(self) -> Float[np.ndarray, "S KJ"]:
        """What sites send out evenly, of all the light that others are to receive."""
        if self.bounces is not None and self.bounces < 2:
            return self._matt
        return self._matt + self.passed.all.reshape(len(self._matt), -1).astype(self.dtype)

    @cached_property
    def arriving(self) -> Float[np.ndarray, "S K J"]:
        """(S,K,J) irradiance that other parts give each site: lux of spectrum k times synthesis function j of `basis`.

        Both sides of sheets have sites: see `prepared.hits` for which those of a triangle are.
        """
        if self.bounces == 0:
            found = np.zeros_like(self._matt)
        elif self.bounces == 1:
            found = self._first
        else:
            passed = self.passed.all.reshape(len(self._first), -1).astype(self.dtype)
            found = self._first + self.prepared.operator @ passed
        return self._by_spectrum(found)

    def _by_spectrum(self, flat: Float[np.ndarray, "S KJ"]) -> Float[np.ndarray, "S K J"]:
        return flat.reshape(len(flat), len(self.spectra), self.basis.size)

    def folds(
        self, spectrum: Float[np.ndarray, "*n L"], illuminants: Sequence[Spectrum | None] = (None,)
    ) -> Float[np.ndarray, "*n KJ M3"]:
        """From coefficients that arrive to XYZ that leave a surface, exact at each wavelength of the basis.

        spectrum : at the basis' wavelengths. illuminants : M, each in place of all lights' spectra; None is their own.
        Y of a perfect diffuser under the reference illuminance is 1.
        """
        scene, synthesis = self.prepared.scene, self.basis.synthesis
        reference = float(scene.viewing.reference_illuminance_lux)
        found = []
        for own in self.spectra:
            lamps = [own if one is None else one for one in illuminants]
            weights = np.concatenate([self._observed(lamp) for lamp in lamps])
            found.append(np.einsum("...l,lj,ml->...jm", spectrum, synthesis, weights / reference, optimize=True))
        return np.concatenate(found, axis=-2)

    def _observed(self, lamp: Spectrum) -> Float[np.ndarray, "m L"]:
        """`Observer.weights`, kept for all states."""
        to = self.basis.wavelengths_nm
        key = id(lamp), to.tobytes()
        if key not in self._weights:
            self._weights[key] = lamp, self.prepared.scene.observer.weights(lamp, to)
        return self._weights[key][1]

    def exits(
        self, eye: VectorLike | Camera, illuminants: Sequence[Spectrum | None] = (None,)
    ) -> Float[np.ndarray, "S M3"]:
        """(S,3M) XYZ that each site sends towards a place, or a camera, of what other parts give it, without what
        lights give it straight away; 0 where it looks away, farther than a neighbour that is seen may.
        """
        hits, part = self.prepared.hits, self.prepared.hits.part_of_site
        centre, radius = self.prepared.centre_and_radius
        points = hits.sites.starts * radius + centre
        to = unit(eye.to_viewer(points) if isinstance(eye, Camera) else finite_vector(eye, "eye") - points)
        above = np.einsum("ni,ni->n", to, hits.sites.normals) > -BEYOND
        arriving = self.arriving.reshape(len(part), -1)
        found = np.zeros((len(part), 3 * len(illuminants)), dtype=self.dtype)
        for number in range(len(self.reflections)):
            mine = np.flatnonzero((part == number) & above)
            found[mine] = arriving[mine] @ self.matt_fold(number, illuminants).astype(self.dtype)
        if self.bounces == 0 or not self.glossy.any():
            return found
        folds = [self.glossy_fold(number, illuminants) if glossy else None for number, glossy in enumerate(self.glossy)]
        glossy_exits(found, self.prepared, self.rays, self.reflections, folds, self.sources, to, self._seen)
        return found

    @cached_property
    def sources(self) -> Sources:
        """What rays of glossy sites bring."""
        return Sources.of(self.rays, self._sent, self._cells, self._ends)

    def matt_fold(self, part: int, illuminants: Sequence[Spectrum | None] = (None,)) -> Float[np.ndarray, "KJ M3"]:
        """`folds` of what a part reflects evenly."""
        one = self.reflections[part]
        return self.folds(self._on_basis(one, one.matt), illuminants)

    def glossy_fold(self, part: int, illuminants: Sequence[Spectrum | None] = (None,)) -> Float[np.ndarray, "R KJ M3"]:
        """`folds` of its other terms."""
        return self.folds(self._fitting[part].spectra, illuminants)


def _planned(
    scene: Scene, reflections: Sequence[Reflection], lights: Sequence[Light], before: SpectralBasis | None = None
) -> SpectralBasis:
    """A basis for all that light may meet: the one that was there before, where it is good for that."""
    wavelengths = common_wavelengths([one.wavelengths_nm for one in reflections])
    spectra = np.concatenate(
        [one.shown @ interpolation_matrix(one.wavelengths_nm, wavelengths).T for one in reflections]
    )
    lamps = [spectrum for light in lights for spectrum in light.spectra]
    return transport_basis(spectra, lamps, scene.observer, wavelengths, before=before)
