# SPDX-License-Identifier: GPL-3.0-or-later
"""Values that Python writes to a uniform block arrive in the shader."""

from itertools import pairwise

import numpy as np
import pytest

from hair_addon.blender.gpu.programs import uniforms
from hair_addon.core.params import declared
from hair_addon.core.shading.fibre import kajiya_kay, strand_variation
from hair_addon.core.shading.tables import lookup_tables
from tests.support.pictures import glsl

NESTED = uniforms.Block("Nested", {"first": "float", "turn": "mat4", "last": "int"})
PROBED = [
    uniforms.VIEW,
    NESTED,
    uniforms.Block(
        "Mixed", {"a": "float", "b": "vec3", "c": "float", "d": "int", "e": "vec4", "f": "vec3", "g": "vec3"}
    ),
    uniforms.Block("Array", {"before": "int", "nested": (NESTED, 3), "after": "float"}),
    uniforms.Block("Lights", {"light": (uniforms.LIGHT, 3), "count": "int"}),
]


BLOCKS = [
    *PROBED,
    *map(uniforms.settings_block, (lookup_tables.Settings, kajiya_kay.Settings, strand_variation.Settings)),
]


def members(dtype):
    """Return the names of a record's members without padding."""
    return [name for name in dtype.names if not name.startswith("unused")]


def scalars(dtype, name):
    """Return GLSL expressions of every number in a record, in the order of `np.ndenumerate` over its members."""
    if dtype.subdtype:
        scalar, shape = dtype.subdtype
        indices = np.ndindex(*shape)
        return [e for index in indices for e in scalars(scalar, name + "".join(f"[{i}]" for i in index))]
    if dtype.names:
        return [e for member in members(dtype) for e in scalars(dtype[member], f"{name}.{member}")]
    return [f"float({name})"]


def number(record, start=1):
    """Fill every number of a record with the next integer, and return the integer after the last."""
    for member in members(record.dtype):
        values = record[member]
        if values.dtype.names:
            for nested in values.reshape(-1):
                start = number(nested, start)
        else:
            record[member] = np.arange(start, start + values.size).reshape(values.shape)
            start += values.size
    return start


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.type_name)
def test_copies_of_a_record_have_its_bytes(block):
    """Copies of a record have its bytes, including padding, which NumPy would not copy."""
    assert sum(form.itemsize for form, *_place in block.dtype.fields.values()) == block.dtype.itemsize
    assert block.dtype.itemsize % 16 == 0


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.type_name)
def test_a_vec3_takes_four_words_as_metal_has_it(block):
    """A vec3 takes four words, because Metal pads it to 16 bytes, where std140 places a scalar in the last four."""
    fields = sorted((block.dtype.fields[name][1], block.dtype[name].shape) for name in members(block.dtype))
    for (offset, shape), (after, _shape) in pairwise(fields):
        assert shape != (3,) or after - offset >= 16


@pytest.mark.parametrize("block", PROBED, ids=lambda block: block.type_name)
def test_shaders_read_blocks_as_they_were_filled(block):
    record = block.record()
    count = number(record) - 1
    expressions = scalars(block.dtype, "probed")
    assert len(expressions) == count
    # No early return: Mesa's software driver is silently wrong beyond eighty nested ones.
    lines = [f"  value = (index == {index}) ? {e} : value;\n" for index, e in enumerate(expressions)]
    text = "float probe(int index)\n{\n  float value = -1.0;\n" + "".join(lines) + "  return value;\n}\n"
    structs = NESTED.source + uniforms.LIGHT.source + (block.source if block is not NESTED else "")
    blocks = {"probed": (block.type_name, record)}
    found = glsl.evaluate(text, "float", "probe(index)", structs=structs, blocks=blocks, index=np.arange(count))
    np.testing.assert_array_equal(found, np.arange(1, count + 1))


@pytest.mark.parametrize(
    "settings",
    [kajiya_kay.Settings(exponent=123.0), lookup_tables.Settings(sigma_a=(0.1, 0.2, 0.3), axes="COSINES", size=32)],
    ids=["kajiya_kay", "marschner"],
)
def test_shaders_read_settings_as_they_were_made(settings):
    for name, _default, details in declared(type(settings)):
        value = getattr(settings, name)
        if details.choices:
            value = [choice[0] for choice in details.choices].index(value)
        returns = "vec3" if isinstance(value, tuple) else "float"
        found = glsl.evaluate(
            "",
            returns,
            f"{returns}(settings.{name})",
            structs=uniforms.settings_block(type(settings)).source,
            blocks={"settings": ("Settings", uniforms.fill(settings))},
            once=np.zeros(1),
        )
        np.testing.assert_allclose(found[0], value, rtol=1e-6)


def test_records_with_the_same_bytes_share_a_buffer(scene):
    """A frame allocates no buffer for records of the last frame; changed records and buffers to update have their
    own.
    """
    record = uniforms.VIEW.record()
    known = uniforms.uniform_buffer(record)
    assert uniforms.uniform_buffer(record.copy()) is known
    assert uniforms.own_uniform_buffer(record) is not known
    record["thickness"] = 2.0
    assert uniforms.uniform_buffer(record) is not known
    record["thickness"] = 0.0
    assert uniforms.uniform_buffer(record) is known
