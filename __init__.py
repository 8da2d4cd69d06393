"""Metamer: measured materials rendered spectrally, and how far off each picture is, in ΔE94.

What a script needs has a name here; each is loaded when it is first asked for, so that `import metamer` costs nothing.

>>> import metamer
>>> metamer.observer("1931_2").white(metamer.illuminant("A")).round(4)
array([1.0985, 1.    , 0.3559])

A catalogue is opened by its folder, a material is taken out by its id, a scene is read from its file, and a picture is
an object with its arrays:

    catalogue = metamer.Catalogue.open("metamer-catalogue")
    copper = catalogue["metal/copper"]
    copper.lab("FL11")
    scene = metamer.load_scene(metamer.shipped_scene("speed_shape"), catalogue)
    picture = metamer.render(scene, catalogue, illuminant="A")
    picture.xyz, picture.white, picture.coverage
    picture.write("copper.png")

Every error that tells of something to mend is a `MetamerError`. What has no name here is in the packages below, which
docs/architecture.md lists: `metamer.spectral`, `.materials`, `.lighting`, `.viewer`, `.calibration`.
"""

from __future__ import annotations

# Type checkers take this for true; `typing` alone would take longer to import than all else here.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from .calibration.regression.assertions import assert_colour_close as assert_colour_close
    from .lighting.camera import Camera as Camera
    from .lighting.environment.booth import light_booth as light_booth
    from .lighting.environment.environment import EnvironmentLight as EnvironmentLight
    from .lighting.environment.map_light import load_environment as load_environment
    from .lighting.environment.softbox import SoftboxLight as SoftboxLight
    from .lighting.lights import DirectionalLight as DirectionalLight
    from .lighting.lights import PointLight as PointLight
    from .lighting.scene import Part as Part
    from .lighting.scene import Scene as Scene
    from .lighting.scene_file.files import load_scene as load_scene
    from .lighting.scene_file.files import shipped_scene as shipped_scene
    from .materials.catalogue.catalogue import Catalogue as Catalogue
    from .materials.catalogue.material import Material as Material
    from .materials.fitting.fit import fit as fit
    from .materials.intake.importing import import_sources as import_sources
    from .materials.records.query import Query as Query
    from .materials.search.neighbours import like as like
    from .runtime.errors import MetamerError as MetamerError
    from .spectral.formats.named_spectra import read_spectra as read_spectra
    from .spectral.formula import delta_e as delta_e
    from .spectral.illuminants import illuminant as illuminant
    from .spectral.observers import observer as observer
    from .spectral.sample import Sample as Sample
    from .spectral.spectrum import Spectrum as Spectrum
    from .viewer.api import render as render
    from .viewer.api import review as review
    from .viewer.match import match as match
    from .viewer.picture import Picture as Picture

    __version__: str

# The same, for when a name is asked for; a test holds the two together.
_HOMES = {
    "Camera": "lighting.camera.Camera",
    "Catalogue": "materials.catalogue.catalogue.Catalogue",
    "DirectionalLight": "lighting.lights.DirectionalLight",
    "EnvironmentLight": "lighting.environment.environment.EnvironmentLight",
    "Material": "materials.catalogue.material.Material",
    "MetamerError": "runtime.errors.MetamerError",
    "Part": "lighting.scene.Part",
    "Picture": "viewer.picture.Picture",
    "PointLight": "lighting.lights.PointLight",
    "Query": "materials.records.query.Query",
    "Scene": "lighting.scene.Scene",
    "SoftboxLight": "lighting.environment.softbox.SoftboxLight",
    "Sample": "spectral.sample.Sample",
    "Spectrum": "spectral.spectrum.Spectrum",
    "assert_colour_close": "calibration.regression.assertions.assert_colour_close",
    "delta_e": "spectral.formula.delta_e",
    "fit": "materials.fitting.fit.fit",
    "illuminant": "spectral.illuminants.illuminant",
    "import_sources": "materials.intake.importing.import_sources",
    "like": "materials.search.neighbours.like",
    "light_booth": "lighting.environment.booth.light_booth",
    "load_environment": "lighting.environment.map_light.load_environment",
    "load_scene": "lighting.scene_file.files.load_scene",
    "match": "viewer.match.match",
    "observer": "spectral.observers.observer",
    "read_spectra": "spectral.formats.named_spectra.read_spectra",
    "render": "viewer.api.render",
    "review": "viewer.api.review",
    "shipped_scene": "lighting.scene_file.files.shipped_scene",
}
__all__ = ["__version__", *_HOMES]  # pyright: ignore[reportUnsupportedDunderAll]


if not TYPE_CHECKING:  # who checks types shall hear of a name that there is not

    def __getattr__(name: str) -> object:
        """Return what a name stands for; from then on it is an attribute like any other."""
        if name == "__version__":
            from .runtime.distribution import installed_version

            found: object = installed_version()
        elif name in _HOMES:
            from importlib import import_module

            module, _, attribute = _HOMES[name].rpartition(".")
            found = getattr(import_module(f".{module}", __name__), attribute)
        else:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        globals()[name] = found
        return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__} - {"TYPE_CHECKING", "annotations"})
