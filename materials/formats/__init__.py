"""Files of materials. `registry` lists the readers; each module that it names is one format.

A format's further parts and its writer bear its name: `gltf_container`, `gltf_json`, `gltf_writer`. All readers use
`naming` (ids, and text fit for a record) and `measured_source` (sources of measured BRDFs, hashes, refusals with their
file); `pictures` is what glTF and loose texture maps share.
"""
