"""Every real file beside the project is recognised for what it is: imported, refused with the right reason, or passed
over. Nothing is fitted here."""

from pathlib import Path

import pytest
from metamer.materials.intake.import_plan import Settings, planned
from metamer.materials.intake.inputs import inputs_of

pytestmark = pytest.mark.slow

# Expected contents of a folder's files: format, materials, refusals; None: any number.
EXPECTED = {
    "brdf/cornell-spectral/*.brdf": ("Cornell scattered BRDF", 1, 0),
    "brdf/rgl/*.bsdf": ("RGL measurement", 1, 0),
    "maps/brick/brick_base_gray.png": ("texture maps", 1, 1),
    "maps/card_blue/dif.png": ("texture maps", 1, 0),
    "meshes/shaderball.glb": ("glTF materials", 1, 0),
    "spectra/cgats/*.sp": ("CGATS", 1, 0),
    "spectra/cgats/*.cie": ("CGATS", 1, 1),
    "spectra/cxf/custom_spectrum_irregular.cxf": ("CxF3", 4, 1),
    "spectra/displays/*.ccss": ("CGATS", None, 0),
    "spectra/exr/BiSpectral.exr": ("bispectral OpenEXR", 2, 0),
    "spectra/exr/Macbeth.exr": ("spectral texture (OpenEXR)", 25, 0),
    "spectra/exr/Ohta1997.exr": ("spectral texture (OpenEXR)", 24, 0),
    "spectra/iestm27/*.spdx": ("IES TM-27", 1, 0),
    "spectra/sets/Clothes_Vhrel.mat": ("MATLAB", 41, 0),
    "spectra/sets/DupontPaintChip_Vhrel.mat": ("MATLAB", 120, 0),
    "spectra/sets/Objects_Vhrel.mat": ("MATLAB", 170, 0),
    "spectra/text/*.csv": ("table (CSV, TSV)", 24, 0),
    "spectra/text/X-Rite_Digital_Colour_Checker.txt": (None, 10, 0),
    "spectra/text/uprtek.xls.txt": ("instrument text", 1, 0),
}
REFUSED = {
    "00001 tl000 pl000 tv000 pv000.jpg": "images that do not say what their numbers are",
    "brick_base_gray.png": "a normal map that does not say which way is up",
    "ColorChecker.cie": "24 samples with LAB and no spectra",
    "ColorCheckerPassport.cie": "50 samples with LAB, XYZ and no spectra",
    "custom_resources.cxf": "no objects",
    "custom_spectrum_irregular.cxf": "a wavelength stands twice",
    "datetime_edge_cases.cxf": "no objects",
    "empty_sections.cxf": "no objects",
    "fileinformation_all_optional.cxf": "no objects",
    "id_reference_validation.cxf": "the objects have other values only",
    "minimal_cxf.cxf": "no objects",
    "multiple_objects.cxf": "the objects have no values",
    "unicode_special_characters.cxf": "the objects have other values only",
}
PASSED_OVER = {"README.md", "LICENSE", "LICENSE.materialx", "LICENSE.isetcam", "fits.npz", "write_binary.py"}
PASSED_OVER |= {"CxF3_Core.xsd", "spot.obj"}


# Photographs of bidirectional textures, environment maps, maps of other sets: pictures, which hold no material alone.
PICTURES, PICTURES_END = ("btf/", "light/", "maps/"), (".jpg", ".png", ".exr", ".json", ".py")


# The folders whose every file is known; beside them may lie others.
KNOWN = ("README.md", "brdf", "btf", "light", "maps", "meshes", "spectra")


@pytest.fixture(scope="module")
def plan(shared_data, tmp_path_factory):
    with inputs_of([shared_data]) as files:
        known = [file for file in files if Path(file.name).relative_to(shared_data).parts[0] in KNOWN]
        found = planned(known, tmp_path_factory.mktemp("none"), Settings(0.5, "mallett-yuksel"))
        return {file.name[len(str(shared_data)) + 1 :]: file for file in found}


@pytest.mark.parametrize("pattern", EXPECTED)
def test_known_files_are_what_they_are(plan, shared_data, pattern):
    name, materials, refused = EXPECTED[pattern]
    paths = [path.relative_to(shared_data).as_posix() for path in shared_data.glob(pattern)]
    assert paths
    for path in paths:
        file = plan[path]
        assert name is None or file.format == name, path
        assert materials is None or len(file.materials) == materials, path
        assert file.count("failed") == refused, [each.reason for each in file.materials]
        assert file.count("new") == len(file.materials) - refused


def test_refusals_are_the_right_ones_and_no_others(plan):
    reasons = {}
    for name, file in plan.items():
        for material in file.materials:
            if material.status == "failed":
                reasons[name.rpartition("/")[2]] = material.reason
                # Each says which file, what was found, and what would do instead.
                file_said = name.partition(".zip/")[0]
                assert file_said in material.reason and "found:" in material.reason and "expected:" in material.reason
    assert set(reasons) == set(REFUSED)
    for name, said in REFUSED.items():
        assert said in reasons[name], reasons[name]


def test_everything_else_is_passed_over(plan):
    passed = {name for name, file in plan.items() if not file.materials}
    assert {name.rpartition("/")[2] for name in passed if not name.startswith(PICTURES)} == PASSED_OVER
    assert not [name for name in passed if name.startswith(PICTURES) and not name.endswith(PICTURES_END)]


def test_every_file_that_is_taken_says_for_what_and_why(plan):
    for name, file in plan.items():
        assert not file.count("new") or all(", by " in words for words in file.taken), name
    said = {name.rpartition("/")[2]: file.taken for name, file in plan.items()}
    assert said["colorchecker_n_ohta.csv"][0].startswith("reflectance in fractions, by the file name 'colorchecker_n")
    assert "the comment 'Reflectance data" in said["DupontPaintChip_Vhrel.mat"][0]


def test_no_id_is_used_twice(plan):
    ids = [material.id for file in plan.values() for material in file.materials if material.status == "new"]
    assert len(ids) == len(set(ids)) == 501
