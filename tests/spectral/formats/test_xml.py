"""XML from strangers, as the reader of CxF3 meets it: entities, other files, depth, size, damage."""

import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.formats import cxf
from metamer.spectral.formats.registry import format_of
from metamer.spectral.formats.shared import xml


def document(name="red", before="", after=""):
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<CxF xmlns="{cxf.NAMESPACE}">{before}<Resources><ObjectCollection>'
        f'<Object ObjectType="Standard" Name="{name}" Id="o1"><CreationDate>2026-01-02T03:04:05Z</CreationDate>'
        '<ColorValues><ReflectanceSpectrum ColorSpecification="s">0.05 0.1 0.4 0.8</ReflectanceSpectrum></ColorValues>'
        '</Object></ObjectCollection><ColorSpecificationCollection><ColorSpecification Id="s"><MeasurementSpec>'
        '<MeasurementType>Spectrum_Reflectance</MeasurementType><WavelengthRange StartWL="380" Increment="10"/>'
        f"</MeasurementSpec></ColorSpecification></ColorSpecificationCollection></Resources>{after}</CxF>"
    )


@pytest.fixture
def written(written):
    return lambda content, name="made.cxf": written(content, name)


def refusal(path):
    with pytest.raises(InputError) as caught:
        cxf.read(path)
    assert str(path) in str(caught.value)
    return caught.value


def test_billion_laughs(written):
    entities = '<!ENTITY a0 "ha">' + "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 10))
    text = document("&a9;").replace("<CxF", f"<!DOCTYPE CxF [{entities}]>\n<CxF", 1)
    path = written(text)
    assert format_of(path) is cxf
    assert "declares an entity" in str(refusal(path))


def test_external_entity(written, tmp_path):
    secret = tmp_path / "secret.txt"
    secret.write_text("0.5 0.5")
    entity = f'<!DOCTYPE CxF [<!ENTITY x SYSTEM "{secret.as_uri()}">]>\n<CxF'
    text = document("&x;").replace("<CxF", entity, 1)
    assert "declares an entity" in str(refusal(written(text)))


def test_a_document_type_of_another_file_is_not_fetched(written):
    text = document().replace("<CxF", '<!DOCTYPE CxF SYSTEM "http://example.org/cxf.dtd">\n<CxF', 1)
    path = written(text)
    assert format_of(path) is cxf and len(cxf.read(path).entries) == 1


def test_deep_nesting(written):
    deep = document(before="<Object>" * 100_000)
    assert "nested too deeply" in str(refusal(written(deep)))


def test_more_bytes_and_elements_than_a_measurement_has(written, monkeypatch):
    path = written(document())
    monkeypatch.setattr(xml, "MOST_ELEMENTS", 10)
    assert "too many elements" in str(refusal(path))
    monkeypatch.setattr(xml, "MOST_BYTES", 100)
    assert "too large" in str(refusal(path))


def test_words_without_end_are_cut(written):
    about = f"<FileInformation><Comment>{'x' * 100_000}</Comment></FileInformation>"
    one = '<x:a xmlns:x="urn:x">1</x:a>'
    custom = f"<CustomResources>{one * 1001}</CustomResources>"
    details = cxf.read(written(document(before=about, after=custom))).details
    assert len(details["comment"]) == 4004 and details["not kept"] == "602 more details"


@pytest.mark.parametrize("cut", [0, 1, 60, 300, 600])
def test_truncated(written, cut):
    refusal(written(document().encode()[:cut]))
