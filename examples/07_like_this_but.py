"""Ask a catalogue for "like this, but", move a slider of a material, and draw a scene along it with its bounces."""

import sys
import tempfile
from pathlib import Path

from metamer import Camera, Catalogue, DirectionalLight, Part, Scene, illuminant, import_sources, like, observer
from metamer.lighting.mesh.shapes import plane, sphere
from metamer.materials.search.edited_material import varied_along
from metamer.materials.search.sliders import slider, sliders
from metamer.runtime.errors import InputError
from metamer.viewer.sheets.material_sweep import along
from metamer.viewer.software.backend import software_session

HEAD = 'family = "sample"\nkind = "analytic"\n'
MATT = '[[material]]\nname = "{name}"\nmodel = "lambert"\nreflectance = {{ constant = {value} }}\n'
COAT = "diffuse = { constant = 0.4 }\nspecular = { constant = 0.05 }\nexponent_u = 40\nexponent_v = 40\n"
SATIN = '[[material]]\nname = "satin"\nmodel = "ashikhmin_shirley"\n' + COAT


def main(folder: Path) -> None:
    matt = "".join(MATT.format(name=f"grey-{value}", value=value / 100) for value in (10, 40, 80))
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "sample.toml").write_text(HEAD + matt + SATIN)
    import_sources([folder / "sample.toml"], folder / "catalogue", jobs=1, budget=1.0)
    catalogue = Catalogue.open(folder / "catalogue")

    found = like(catalogue, "sample/grey-40", {"glossier": 1})
    for one in found.found:
        print(f"glossier than {found.of.id}: {one.summary.id}, by {found.wish.got(one.look)['glossier']:.1f} stops")
    satin = catalogue["sample/satin"]
    for one in sliders(satin.surface()):
        print(f"{one.name}: {one.value:g}, {one.domain.words}")
    try:
        slider(satin.surface(), "diffuse_scale").at(3)
    except InputError as refused:
        print(refused)

    # The rays between floor and ball are traced for the first picture and kept for all others.
    floor = Part("floor", plane(4, 4).placed(translate=(0, -1.1, 0)), satin.id)
    lamp, camera = DirectionalLight((0.3, 1.0, 0.5), illuminant("D65")), Camera(width=32, height_px=32, samples=1)
    scene = Scene((floor, Part("ball", sphere(2), "sample/grey-80")), (lamp,), (camera,), observer("1931_2"), bounces=1)
    steps = varied_along(satin, {"diffuse_scale": (1.0, 0.2)}, 3)
    with software_session() as renderer:
        for made, picture in along(scene, "floor", steps, catalogue, renderer):
            print(f"{made.id}: mean Y {picture.xyz[..., 1].mean():.3f}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp(prefix="metamer-")))
