"""Tables in the layout of the RGL data base: read back as they were written, and close to what they stand for."""

import numpy as np
import pytest
from metamer.materials.analytic import MODELS, AshikhminShirley
from metamer.materials.core.protocol import sphere_protocol
from metamer.materials.formats.rgl import read_rgl, read_tensors, write_tensors
from metamer.materials.measured.rgl import RglBrdf
from metamer.materials.measured.rgl_measurement import RglMeasurement
from metamer.materials.measured.rgl_table import rgl_fields
from metamer.runtime.errors import InputError
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM


@pytest.mark.parametrize("kind", ["u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8", ">f8"])
def test_tensors_come_back_bit_for_bit(tmp_path, kind):
    fields = {"a": np.arange(6).reshape(2, 3).astype(kind), "b ü": np.zeros((0, 4), kind), "c": np.ones((), kind)}
    write_tensors(tmp_path / "x.bsdf", fields)
    back = read_tensors(tmp_path / "x.bsdf")
    assert list(back) == list(fields)
    for name, field in fields.items():
        assert back[name].dtype == field.dtype.newbyteorder("<")
        np.testing.assert_array_equal(back[name], field)


def test_text_is_no_tensor(tmp_path):
    with pytest.raises(InputError, match="cannot be stored"):
        write_tensors(tmp_path / "x.bsdf", {"a": np.array(["text"])})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow_cases("ashikhmin_shirley", "cook_torrance", "oren_nayar", "metallic_roughness", "coated_diffuse")
@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.NAME)
def test_a_table_looks_like_its_brdf(tmp_path, model, record_property):
    sphere = sphere_protocol(32)
    for brdf in model.examples(WORKING_WAVELENGTHS_NM)[:3]:
        if not brdf.isotropic:
            continue
        write_tensors(tmp_path / "x.bsdf", rgl_fields(brdf, "a test"))
        measurement = read_rgl(tmp_path / "x.bsdf")
        assert measurement.description == "a test" and measurement.isotropic
        error = sphere.compare(sphere.reference(brdf), sphere.reference(RglBrdf(measurement)))
        record_property(f"{model.NAME}: mean, p99", (error.mean, error.p99))
        assert error.mean < 0.1 and error.p99 < 1.0, (model.NAME, error)


@pytest.mark.slow
def test_a_brushed_surface_looks_like_itself_at_every_turn():
    one = AshikhminShirley.examples(WORKING_WAVELENGTHS_NM)[2]
    brushed = AshikhminShirley(one.diffuse, one.specular, 20.0, 100.0)
    measurement = RglMeasurement("", rgl_fields(brushed))
    sphere = sphere_protocol(20, False)
    error = sphere.compare(sphere.reference(brushed), sphere.reference(RglBrdf(measurement)))
    assert not measurement.isotropic and error.mean < 0.6 and error.p95 < 1.5, error
